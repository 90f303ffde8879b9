"""The course of experiments: what comes next, how long, and when it ends."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.mismatch import policy
from identification.mismatch.diagnosis import (
    Adequate,
    Ambiguous,
    Diagnosis,
    Explained,
    Finding,
    HeldOutRmse,
    NextExperiment,
    PlanStep,
    RivalFinding,
    Rmse,
    Unexplained,
)
from identification.mismatch.next_experiment.sequential_experiment import (
    Course,
    End,
    allowance,
    belief,
    course_json,
    next_step,
)
from identification.mismatch.next_experiment.sweeps import BUDGET
from identification.mismatch.unexplained import Remainder
from identification.mismatch.value import Where


def sweep(power_=0.9):
    return NextExperiment("separates a from b", (PlanStep(5.0, 60.0),), power_)


def diagnosis(answer):
    held, train = HeldOutRmse(1.0, 1.0, 1.0, ""), Rmse(1.0, 1.0)
    return Diagnosis(("r",), "T1", answer, "C V|V|", {}, (), (), {}, train, held, 1.0, 0.5)


def doubtful(*effects, power_=0.9):
    rivals_ = tuple(RivalFinding(e, "", {}, 0.1, "") for e in effects[1:])
    return diagnosis(Ambiguous((Finding(effects[0], "", "", {}, 1e-9, 9.0, 0.5, rivals_),), sweep(power_)))


LEFT = Remainder(Where("time", 0.0, 1.0, "s"), 0.5, 1e-9, (), "")


def course(*found, budget=1000.0):
    now = Course(budget, belief(found[0]), 10.0)
    for i, each in enumerate(found[1:]):
        now = now.after(60.0, 100.0 * (i + 1), each)
    return now


@pytest.mark.parametrize(
    ("now", "needs", "ends"),
    [
        (course(diagnosis(Adequate())), 10.0, "settled"),
        (course(diagnosis(Explained((Finding("a", "", "", {}, 0.0, 1.0, 1.0, ()),)))), 10.0, "settled"),
        (course(diagnosis(Unexplained((), LEFT, None))), 10.0, "unexplained"),
        (course(doubtful("a", "b")), 10.0, None),
        (course(doubtful("a", "b", power_=0.01)), 10.0, "hopeless"),
        (course(doubtful("a", "b"), budget=50.0), 60.0, "budget"),
        (course(doubtful("a", "b"), doubtful("b", "a"), doubtful("a", "b")), 10.0, "same_doubt"),
        (course(doubtful("a", "b"), doubtful("a", "c"), doubtful("a", "b")), 10.0, None),
    ],
)
def test_the_next_step_by_table(now, needs, ends):
    step = next_step(now, needs)
    if ends is None:
        assert step == now.now.experiment
    else:
        assert isinstance(step, End)
        assert step.reason == ends


def test_a_round_without_an_experiment_is_a_mistake():
    with pytest.raises(ValueError, match="needs an experiment"):
        course(diagnosis(Adequate()), diagnosis(Adequate()))


def test_a_course_counts_its_time_and_tells_its_rounds():
    now = course(doubtful("a", "b"), doubtful("a", "c"), diagnosis(Adequate()))
    assert (now.on_bench, now.spent) == (120.0, 200.0)
    told = course_json(now, End("settled", "done"))
    assert [r["believed"] for r in told["rounds"]] == ["a or c", "nothing is missing"]
    assert told["first"] == {"verdict": "ambiguous", "believed": "a or b"}
    assert belief(diagnosis(Unexplained((), LEFT, None))).doubt == {frozenset({"unexplained at time"})}


@settings(max_examples=50, deadline=None)
@given(st.floats(0, 5000), st.floats(0, 100))
def test_half_of_what_is_left_while_a_second_sweep_fits_into_the_other_half(left, overhead):
    found = allowance(left, overhead)
    least = policy.next_experiment.SHORTEST_SWEEP
    assert found >= least
    if left - overhead > 2 * BUDGET:
        assert found == pytest.approx((left - overhead) / 2)
    elif left - overhead > least:
        assert found == pytest.approx(left - overhead)
