"""The answer: its verdict by table, what faults, lines and a twin add to it, and all of it as JSON."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from identification.mismatch import policy
from identification.mismatch.answer import stage
from identification.mismatch.answer.against_twin import changed_constant, given_values, twin_of, with_twin
from identification.mismatch.answer.as_json import diagnosis_json
from identification.mismatch.answer.draft import Draft
from identification.mismatch.answer.fault_findings import fault_finding, with_channels
from identification.mismatch.answer.periodic_findings import (
    line_finding,
    line_place,
    line_values,
    told_lines,
    twin_line,
    with_lines,
)
from identification.mismatch.answer.remainder import remainder_of
from identification.mismatch.answer.report_assembly import curves_of, finding_of, values_of
from identification.mismatch.answer.verdict import decided
from identification.mismatch.diagnosis import (
    Adequate,
    Ambiguous,
    Diagnosis,
    Explained,
    Finding,
    Mismatch,
    NextExperiment,
    PlanStep,
    Remainder,
    RivalFinding,
    Unexplained,
)
from identification.mismatch.estimate.confidence_intervals import Interval
from identification.mismatch.faults.channel_faults import Fault
from identification.mismatch.faults.stage import Sound
from identification.mismatch.locate.residual_structure_test import residual_structure
from identification.mismatch.locate.stage import run as located_by
from identification.mismatch.name.stage import run as named_by
from identification.mismatch.periodic.order_tracking import Part
from identification.mismatch.periodic.periodic_disturbances import Line
from identification.mismatch.unnamed.stage import Completed
from identification.mismatch.unnamed.stage import run as completed_by
from identification.mismatch.validate.stage import run as validated_by
from identification.mismatch.value import Value, Where
from identification.physics.asymmetry import Asymmetry
from identification.physics.dead_band import DeadBand
from identification.twin import Twin
from tests.identification.diagnosed_runs import NOISE, C, dead_band
from tests.identification.mismatch.small import known_noise, rng, selected, short

BAND, UNEVEN = DeadBand(), Asymmetry()
EQUAL = policy.select.RIVALS_EQUAL_BIC


def finding(effect="dead_band", *losses, statement="Dead band."):
    rivals = tuple(RivalFinding(f"rival{i}", "", {}, loss, "") for i, loss in enumerate(losses))
    return Finding(effect, "", statement, {"w": Value(1.0, 0.1, "V")}, 1e-9, 50.0, 1.0, rivals)


LEFT = Remainder(Where("time", 1.0, 2.0, "s"), 0.5, 1e-9, ((1.5, 0.2, 0.1),), "Something is left.")
SWEEP = NextExperiment("separates a from b", (PlanStep(5.0, 3.0),), 0.9)


# ---------------------------------------------------------------- the verdict


ROWS = list(
    product([None, LEFT], [(), (finding(),), (finding("a", EQUAL + 1),), (finding("a", EQUAL - 1),)], [None, SWEEP])
)


@pytest.mark.parametrize(("remainder", "findings", "experiment"), ROWS)
def test_the_verdict_by_table(remainder, findings, experiment):
    """Something left before all else; then rivals that do as well; then findings; else nothing is missing."""
    verdict = decided(findings, remainder, experiment)
    rivals = any(r.bic_loss < EQUAL for f in findings for r in f.rivals)
    if remainder is not None:
        assert isinstance(verdict, Unexplained)
        assert (verdict.findings, verdict.remainder, verdict.next_experiment) == (findings, remainder, experiment)
    elif rivals:
        assert isinstance(verdict, Ambiguous)
        assert (verdict.findings, verdict.next_experiment) == (findings, experiment)
    elif findings:
        assert isinstance(verdict, Explained)
        assert verdict.findings == findings
    else:
        assert isinstance(verdict, Adequate)


# ---------------------------------------------------------------- channel faults


def draft(**changes):
    how = {"baseline_model": "C V|V|", "baseline": {"C": Value(C, 0.01, "N/V^2")}, "mismatch": (), "findings": ()}
    return Draft(**{**how, "model_terms": (), "model": {"C": Value(C, 0.01, "N/V^2")}, **changes})


def fault(kind="reversed", *, grave=True, recording="run-1", p=1e-12):
    return Fault(recording, "thrust", kind, "thrust is wrong.", p, {"factor": Value(60.0, 1.0, "1")}, grave=grave)


def test_grave_faults_are_the_first_findings_and_say_what_was_put_right():
    told = with_channels(draft(findings=(finding(),)), [fault()], ["run-1"])
    assert [f.effect for f in told.findings] == ["channel_fault", "dead_band"]
    assert told.findings[0].statement == "thrust is wrong."
    assert told.notes == ("for the model this was put right: thrust is wrong.",)
    two = with_channels(draft(), [fault()], ["run-1", "run-2"])
    assert two.findings[0].statement == "run-1: thrust is wrong.", "of several recordings it says which"
    held_out = with_channels(draft(), [fault(recording="other")], ["run-1"])
    assert held_out.findings[0].statement.startswith("other: ")


def test_what_is_not_grave_or_beyond_repair_is_a_note():
    told = with_channels(draft(), [fault("unsigned", grave=False), fault("nan")], ["run-1"])
    assert told.findings == ()
    assert told.notes == ("run-1: thrust is wrong.", "run-1: thrust is wrong.")


def test_a_fault_as_a_finding_has_a_logarithm():
    found = fault_finding(fault(p=0.0))
    assert (found.form, found.parameters["factor"]) == ("reversed", Value(60.0, 1.0, "1"))
    assert found.p_value > 0
    assert found.bic_gain == pytest.approx(-2 * np.log(found.p_value))


# ---------------------------------------------------------------- lines


def line(frequency=20.0, amplitude=1.0, *, ratio=None, gain=100.0, rival=None, unit="rev"):
    kind = "fixed" if ratio is None else "rotation"
    std = None if ratio is None else 0.001
    return Line(
        kind,
        frequency,
        0.01,
        ratio,
        std,
        amplitude,
        0.05,
        0.3,
        0.1,
        1e-9,
        gain,
        f"A line at {frequency:g} Hz.",
        rival=rival,
        parts=(Part(0, 0.0, 9.0, 1.0, 0.0),),
        unit=unit,
        band=(frequency - 0.1, frequency + 0.1),
        power=0.5,
    )


def test_a_line_is_a_finding_with_its_numbers_and_its_rival():
    found = line_finding(line(ratio=3.0))
    assert found.effect == "periodic_disturbance"
    assert found.parameters["periods_per_turn"] == Value(3.0, 0.001, "1")
    assert found.parameters["frequency"] == Value(20.0, 0.01, "Hz")
    assert found.probability == 1.0
    other = line_finding(line(gain=100.0, rival=line(ratio=3.0, gain=99.0)))
    (rival,) = other.rivals
    assert (rival.form, rival.bic_loss) == ("rotation", pytest.approx(1.0))
    assert other.probability == pytest.approx(1 / (1 + np.exp(-0.5)))
    far = line_finding(line(gain=1000.0, rival=line(ratio=3.0, gain=10.0)))
    assert far.rivals == ()


def test_of_volt_seconds_the_unit_is_told_and_of_a_slipping_phase_none():
    values = line_values(twin_line(replace(line(ratio=0.4, unit="V s"), phase=None, phase_std=None)))
    assert values["periods_per_volt_second"].unit == "1/(V s)"
    assert "phase" not in values


def test_a_place_of_a_line_is_its_share_of_the_residual():
    place = line_place(line(), 2.0)
    assert place.where == Where("frequency", 19.9, 20.1, "Hz")
    assert place.share == pytest.approx(0.5 / 4.0)
    assert place.statement == "12 % of the residual lies at frequency 19.9 to 20.1 Hz: a line of one frequency."
    assert line_place(line(), 0.0).share == 1.0
    assert "goes with the rotor" in line_place(line(ratio=3.0), 2.0).statement
    assert "at one speed" in line_place(line(rival=line(ratio=3.0)), 2.0).statement


def twin(*lines, **changes):
    _, estimate = known_noise({BAND: (1.0,)}, [short(volts=dead_band(1.2))])
    data, _ = known_noise({BAND: (1.0,)}, [short(volts=dead_band(1.2))])
    found = twin_of(estimate, data, [short(volts=dead_band(1.2))], None)
    return replace(found, lines=tuple(map(twin_line, lines)), origin="the twin T", **changes)


def test_lines_are_a_place_a_finding_a_parameter_and_a_part_of_the_twin():
    told = with_lines(draft(twin=twin()), (line(), line(31.0)), 2.0, None)
    assert [f.parameters["frequency"].value for f in told.findings] == [20.0, 31.0]
    assert len(told.mismatch) == 2
    assert told.model_terms == ("periodic_disturbance", "periodic_disturbance")
    assert told.model["periodic_disturbance.frequency"].value == 20.0
    assert told.model["periodic_disturbance#2.frequency"].value == 31.0
    assert [x.frequency for x in told.twin.lines] == [20.0, 31.0]


@pytest.mark.parametrize(
    ("now", "news"),
    [
        (line(20.02), False),
        (line(20.9), True),
        (line(20.02, amplitude=2.0), True),
        (line(20.02, ratio=3.0), True),
    ],
    ids=["same", "elsewhere", "louder", "another kind"],
)
def test_against_a_twin_only_what_changed_is_news(now, news):
    before = twin(line())
    assert told_lines((now,), before) == ((now,) if news else ())
    told = with_lines(draft(twin=twin()), (now,), 2.0, before)
    assert len(told.findings) == int(news)
    assert told.baseline["periodic_disturbance.frequency"].value == 20.0


def test_a_line_that_grew_says_from_what_and_one_that_went_is_noted():
    before = twin(line(), line(31.0))
    told = with_lines(draft(twin=twin()), (line(20.02, amplitude=2.0),), 2.0, before)
    assert told.findings[0].statement == "A line at 20.02 Hz, where the twin T has 1 N."
    assert told.notes == ("the twin T has a line at 31 Hz, not found here.",)
    assert [x.frequency for x in told.twin.lines] == [20.02, 31.0]


def test_turns_of_another_kind_are_another_line():
    assert told_lines((line(ratio=3.0),), twin(line(ratio=3.0))) == ()
    assert len(told_lines((line(ratio=3.0, unit="V s"),), twin(line(ratio=3.0)))) == 1
    assert len(told_lines((line(ratio=3.2),), twin(line(ratio=3.0)))) == 1


# ---------------------------------------------------------------- a twin


@pytest.fixture(scope="module")
def fitted():
    runs = [short(volts=dead_band(1.2), seed=s, tare=s + 1.0, seconds=60.0) for s in (0, 1)]
    data, estimate = known_noise({BAND: (1.0,), UNEVEN: (1.0,)}, runs)
    return runs, data, estimate


def test_a_twin_holds_the_fit(fitted):
    runs, data, estimate = fitted
    found = twin_of(estimate, data, runs, None)
    assert isinstance(found, Twin)
    now = estimate.fit
    assert (found.C, found.thruster, found.driver_quantity) == (now.theta.C, "T1", "command_voltage")
    assert [t.values for t in found.terms] == list(now.theta.terms)
    assert found.names == ("C", "dead_band.half_width", "asymmetry.ratio")
    at = now.layout
    places = [0, at.of(BAND).start, at.of(UNEVEN).start]
    assert np.array(found.covariance) == pytest.approx(now.cov[np.ix_(places, places)])
    assert [s.tare for s in found.sources] == pytest.approx(now.theta.tares)
    assert found.interval == pytest.approx(0.125)
    assert found.rate_per_driver is None
    values = given_values(found)
    assert values["dead_band.half_width"].std == pytest.approx(now.std[places[1]])


def test_a_constant_that_moved_is_a_finding_with_its_sigmas(fitted):
    runs, data, estimate = fitted
    before = replace(twin_of(estimate, data, runs, None), origin="the twin T")
    assert changed_constant(before, estimate, "the twin T", "N/V^2") is None
    moved = replace(before, C=0.9 * before.C)
    found = changed_constant(moved, estimate, "the twin T", "N/V^2")
    both = np.hypot(estimate.fit.std[0], np.sqrt(before.covariance[0][0]))
    z = 0.1 * before.C / both
    assert f"{z:.0f} sigma" in found.statement
    assert "+11 %" in found.statement
    assert found.parameters["before"].value == pytest.approx(0.9 * before.C)
    now = estimate.fit
    unknown = replace(now, free=np.zeros_like(now.free), jacobian=np.empty((now.residual.size, 0)))
    assert changed_constant(moved, replace(estimate, fit=unknown), "", "") is None, "an error that nobody knows"


def test_against_a_twin_its_terms_are_in_the_model_and_the_same_effect_comes_on_top(fitted):
    runs, data, estimate = fitted
    before = replace(twin(), origin="the twin T")
    plain = draft(
        findings=(finding(), finding("asymmetry")), model={**values_of(estimate.fit, data)}, model_terms=("dead_band",)
    )
    told = with_twin(plain, estimate, data, runs, before)
    assert told.baseline_model == "the twin T (C V|V| with dead_band)"
    assert told.findings[0].statement.startswith("On top of what the twin T has: ")
    assert told.findings[1].statement == "Dead band."
    assert told.model_terms == ("dead_band", "dead_band")
    assert told.model["dead_band.half_width"] == told.baseline["dead_band.half_width"]
    assert told.model["dead_band#2.half_width"].value == estimate.fit.values[BAND][0]
    alone = with_twin(draft(), estimate, data, runs, None)
    assert (alone.findings, alone.baseline_model) == ((), "C V|V|")
    assert alone.twin is not None


# ---------------------------------------------------------------- values and findings


def test_values_are_those_of_the_fit_each_tare_by_its_run(fitted):
    runs, data, estimate = fitted
    found = values_of(estimate.fit, data)
    assert list(found)[:3] == ["C", "dead_band.half_width", "asymmetry.ratio"]
    assert found["C"] == Value(estimate.fit.theta.C, float(estimate.fit.std[0]), "N/V^2")
    for run, tare in zip(runs, estimate.fit.theta.tares, strict=True):
        assert found[f"tare[{run.recording_id}]"].value == tare
    known = values_of(estimate.fit, data, {BAND: (Interval(1.0, 1.6),)})
    value = known["dead_band.half_width"]
    assert value.ends == (1.0, 1.6)
    assert value.interval == (1.0, 1.6)
    half = max(1.6 - value.value, value.value - 1.0)
    assert value.std == pytest.approx(half / 1.959964)


def test_curves_are_the_rows_with_both_models(fitted):
    _, data, estimate = fitted
    _, before = known_noise({}, fitted[0])
    curves = curves_of(before, estimate, data)
    assert [c.recording_id for c in curves] == [h.recording_id for h in data.histories]
    for curve, h, r in zip(curves, data.histories, data.rows, strict=True):
        assert curve.thrust == pytest.approx(h.thrust[r])
        assert np.std(curve.thrust - curve.model) == pytest.approx(NOISE, rel=0.15)
        assert np.std(curve.thrust - curve.baseline) > 3 * NOISE


# ---------------------------------------------------------------- the whole of it


def told(recording, values, terms=()):
    """The stages behind a search whose model is known."""
    chosen = selected(values, [recording], terms)
    located = located_by(chosen, rng(0))
    named = named_by(chosen, located)
    validated = validated_by(located.estimate, named, chosen.data, ())
    completed = completed_by(chosen, located, validated, (), rng(1))
    sound = Sound(chosen.data.histories, (), (), ())
    case = stage.Case((recording,), sound, (), (), None, ("a note",))
    found = stage.run(case, chosen, located, completed, None, rng(2))
    return found, chosen, completed, located


def test_a_true_model_is_explained_with_its_error():
    found, chosen, completed, _ = told(short(volts=dead_band(1.2), seconds=120.0), {BAND: (1.0,)})
    assert found.verdict == "explained"
    (one,) = found.findings
    assert one.parameters["half_width"].value == pytest.approx(1.2, abs=4 * one.parameters["half_width"].std)
    again = finding_of(completed.earned[0], chosen.data.scale, completed.intervals)
    assert (one.statement, one.bic_gain, one.parameters) == (again.statement, again.bic_gain, again.parameters)
    assert found.train.before > 3 * found.train.after
    assert found.train.after == pytest.approx(NOISE, rel=0.1)
    assert found.heldout.after == pytest.approx(NOISE, rel=0.15)
    assert found.chi2_per_dof == pytest.approx(1.0, abs=0.2)
    assert found.notes == ("a note",)
    assert found.unexplained is None
    assert found.mismatch[0].where.quantity == "command_voltage"


def test_a_bare_model_of_a_clean_run_is_adequate():
    found, *_ = told(short(), {})
    assert (found.verdict, found.findings, found.mismatch) == ("adequate", (), ())
    assert found.model == found.baseline


def test_what_no_name_carries_is_told_with_its_place_and_what_resembles_it():
    """A dead band that differs between the directions, and no asymmetry to say so."""

    def change(t, V, _F):
        x = np.sign(V) * np.maximum(np.abs(V) - np.where(V < 0, 0.4, 1.6), 0.0)
        return C * x * np.abs(x)

    found, chosen, completed, _ = told(short(change=change), {BAND: (1.0,)})
    assert found.verdict == "unexplained"
    assert found.findings == ()
    left = found.unexplained
    assert any(text.startswith("dead_band: ") and "both directions" in text for text in left.resembles)
    assert "It resembles dead_band, but its parameter is not the same" in left.statement
    assert left.where.low < left.where.high
    assert left.shape
    quiet = replace(completed, open_ended=False)
    assert remainder_of(quiet, chosen.data, ()) is None


def test_a_place_without_a_flexible_term_is_that_of_the_clearest_structure():
    chosen = selected({}, [short(change=lambda t, V, F: F + 0.5 * np.sin(t / 6))])
    after = chosen.after
    left = residual_structure(after.fit, chosen.data, after.weights, rng(0))
    completed = Completed(after, (), {}, (), None, True, after, left)
    found = remainder_of(completed, chosen.data, ())
    assert found.where.quantity == "time"
    assert found.flexible == ()
    assert found.p_value == left.p_value


# ---------------------------------------------------------------- as JSON


def plain(node):
    """Whether it is all numbers that are numbers, texts and nothing."""
    if isinstance(node, dict):
        return all(isinstance(k, str) and plain(v) for k, v in node.items())
    if isinstance(node, list):
        return all(map(plain, node))
    return node is None or isinstance(node, str | bool | int) or bool(np.isfinite(node))


@pytest.fixture(scope="module")
def explained():
    return told(short(volts=dead_band(1.2), seconds=120.0), {BAND: (1.0,)})[0]


@pytest.mark.parametrize(("x", "y"), product([np.nan, np.inf, -np.inf, 0.5], repeat=2))
def test_whatever_the_numbers_the_json_is_one(explained, x, y):
    """Not finite becomes null, everywhere."""
    spoiled = replace(
        explained,
        baseline={"C": Value(x, y, "N/V^2")},
        mismatch=(Mismatch("thrust", Where("time", x, y, "s"), x, y, "there"),),
        answer=Unexplained(
            (replace(finding(), p_value=x, bic_gain=y),), replace(LEFT, share=x, p_value=y, shape=((x, y, x),)), SWEEP
        ),
        whiteness_p=x,
        chi2_per_dof=y,
    )
    found = diagnosis_json(spoiled)
    assert plain(found)
    json.dumps(found, allow_nan=False)


@pytest.mark.parametrize(
    "answer",
    [Adequate(), Explained((finding(),)), Ambiguous((finding("a", 0.5),), SWEEP), Unexplained((), LEFT, None)],
    ids=lambda a: a.name,
)
def test_every_verdict_has_its_keys(explained, answer):
    found = diagnosis_json(replace(explained, answer=answer))
    assert (found["verdict"], found["format"], found["version"]) == (answer.name, "thruster-rig-diagnosis", 1)
    assert (found["unexplained"] is None) == (answer.name != "unexplained")
    assert (found["next_experiment"] is None) == (answer.name != "ambiguous")
    assert isinstance(found["statement"], str)
    assert [f["effect"] for f in found["findings"]] == [f.effect for f in replace(explained, answer=answer).findings]
    if answer.name == "ambiguous":
        assert found["next_experiment"] == {
            "why": SWEEP.why,
            "steps": [{"command_voltage": 5.0, "duration": 3.0, "flow_speed": 0.0}],
            "expected_power": 0.9,
        }
        assert found["findings"][0]["rival_details"][0]["bic_loss"] == 0.5
    if answer.name == "unexplained":
        assert found["unexplained"]["where"] == {"quantity": "time", "from": 1.0, "to": 2.0, "unit": "s"}
        assert found["unexplained"]["shape"] == [{"at": 1.5, "residual": 0.2, "std": 0.1}]
        assert found["unexplained"]["flexible"] is None


def test_intervals_of_values_are_told_as_they_are():
    lopsided = Value(1.0, 0.2, "V", (0.7, 1.9))
    assert isinstance(lopsided, Value)
    data = replace(told(short(), {})[0], baseline={"C": lopsided, "D": Value(1.0, 0.5, "N")})
    assert isinstance(data, Diagnosis)
    found = diagnosis_json(data)["baseline"]["parameters"]
    assert (found["C"]["low"], found["C"]["high"]) == (0.7, 1.9)
    assert (found["D"]["low"], found["D"]["high"]) == pytest.approx((1.0 - 0.98, 1.98), abs=1e-3)
