"""From doubt to answer: which experiment next, and when there is none. Diagnoses are made up."""

from dataclasses import replace

import pytest

from identification.mismatch import policy
from identification.mismatch.answer.verdict import decided
from identification.mismatch.diagnosis import (
    Diagnosis,
    Finding,
    HeldOutRmse,
    NextExperiment,
    PlanStep,
    RivalFinding,
    Rmse,
)
from identification.mismatch.next_experiment.sequential_experiment import (
    Course,
    End,
    allowance,
    belief,
    course_json,
    next_step,
    opening_line,
    round_line,
)
from identification.mismatch.unexplained import Remainder
from identification.mismatch.value import Where

HELD = HeldOutRmse(1.0, 0.1, 0.1, "blocks")
SWEEP = NextExperiment("separates exponent from dead_band", (PlanStep(0.0, 3.0), PlanStep(9.0, 4.0)), 0.9)


def finding(effect, **rivals):
    others = tuple(RivalFinding(name, "", {}, loss, "") for name, loss in rivals.items())
    return Finding(effect, "", f"{effect} was left out.", {}, 1e-9, 90.0, 0.5, others)


def diagnosis(verdict, *findings, experiment=None, place=""):
    where = Where(place, 0.0, 1.0, "V")
    left = Remainder(where, 0.5, 1e-9, (), "Something is left.") if place else None
    found = Diagnosis(
        *(("a",), "T1", decided(findings, left, experiment, HELD), "C V|V|", {}, (), (), {}),
        *(Rmse(1.0, 0.1), HELD, 1.0, 0.5),
    )
    assert found.verdict == verdict
    return found


DOUBT = diagnosis("ambiguous", finding("exponent", dead_band=1.0, linear_term=8.0), experiment=SWEEP)
ANSWER = diagnosis("explained", finding("exponent", dead_band=8.0))


@pytest.fixture
def course():
    return Course(1200.0, belief(DOUBT), 8.0)


def test_only_equally_good_rivals_are_a_doubt():
    assert belief(DOUBT).doubt == {frozenset({"exponent", "dead_band"})}
    assert belief(DOUBT).says == "exponent or dead_band"
    assert belief(ANSWER).doubt == frozenset()
    assert belief(diagnosis("adequate")).says == "nothing is missing"


def test_a_doubt_is_run_and_an_answer_ends_it(course):
    assert next_step(course, 100.0) == SWEEP
    after = course.after(80.0, 95.0, ANSWER)
    end = next_step(after, 0.0)
    assert end == End("settled", "one answer stands: exponent")
    assert (after.on_bench, after.spent) == (80.0, 95.0)
    with pytest.raises(ValueError, match="none was proposed"):
        after.after(1.0, 96.0, ANSWER)


def test_what_is_said_of_each_round(course):
    after = course.after(80.0, 95.0, ANSWER)
    assert opening_line(course) == "first: ambiguous: exponent or dead_band (0:08 of 20:00 min spent)"
    assert round_line(after) == (
        "round 1: believed exponent or dead_band; ran 80 s that separates exponent from dead_band (expected power "
        "0.90); now explained: exponent (1:35 of 20:00 min spent)"
    )
    assert "now still ambiguous" in round_line(course.after(80.0, 95.0, DOUBT))


def test_an_experiment_that_does_not_fit_is_not_begun(course):
    assert next_step(course, 1192.0) == SWEEP
    end = next_step(course, 1193.0)
    assert (end.reason, end.says) == (
        "budget",
        "exponent or dead_band: the next experiment takes 1193 s, but 1192 s are left",
    )


def test_the_same_doubt_is_given_two_rounds(course):
    once = course.after(80.0, 100.0, DOUBT)
    assert next_step(once, 100.0) == SWEEP
    assert next_step(once.after(80.0, 200.0, DOUBT), 100.0).reason == "same_doubt"
    other = diagnosis("ambiguous", finding("heating", zero_drift=0.0), experiment=SWEEP)
    assert next_step(once.after(80.0, 200.0, other).after(80.0, 300.0, DOUBT), 100.0) == SWEEP


def test_a_sweep_that_tells_nothing_is_not_run(course):
    weak = replace(SWEEP, why="to tell asymmetry from torque_crosstalk takes dead weights", expected_power=0.01)
    end = next_step(replace(course, first=replace(course.first, experiment=weak)), 60.0)
    assert end.reason == "hopeless"
    assert "dead weights" in end.says


def test_what_no_term_carries_is_an_end_unless_a_sweep_is_proposed():
    bare = belief(diagnosis("unexplained", place="time"))
    assert bare.doubt == {frozenset({"unexplained at time"})}
    assert next_step(Course(600.0, bare, 5.0), 0.0).reason == "unexplained"
    known = belief(diagnosis("unexplained", finding("exponent", dead_band=1.0), experiment=SWEEP, place="time"))
    assert known.says == "something at time that no term carries, beside exponent or dead_band"
    assert next_step(Course(600.0, known, 5.0), 60.0) == SWEEP


def test_a_sweep_is_given_half_of_what_is_left_while_there_is_plenty():
    assert allowance(1200.0, 40.0) == 580.0
    assert allowance(500.0, 40.0) == 460.0
    assert allowance(10.0, 40.0) == policy.next_experiment.SHORTEST_SWEEP


def test_the_way_is_in_the_json(course):
    after = course.after(80.0, 95.0, ANSWER)
    said = course_json(after, next_step(after, 0.0))
    assert said["reason"] == "settled"
    assert said["first"] == {"verdict": "ambiguous", "believed": "exponent or dead_band"}
    assert [each["believed"] for each in said["rounds"]] == ["exponent"]
    assert (said["budget"], said["spent"], said["on_bench"]) == (1200.0, 95.0, 80.0)
