"""The answer: its verdict by table, what channel faults add to it, values and the whole of it."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from identification.mismatch import policy
from identification.mismatch.answer.fault_findings import fault_finding, with_channels
from identification.mismatch.answer.remainder import remainder_of
from identification.mismatch.answer.report_assembly import curves_of, finding_of, values_of
from identification.mismatch.answer.verdict import decided
from identification.mismatch.diagnosis import (
    Adequate,
    Ambiguous,
    Explained,
    HeldOutRmse,
    Unexplained,
)
from identification.mismatch.estimate.confidence_intervals import Interval
from identification.mismatch.faults.channel_faults import Fault
from identification.mismatch.locate.residual_structure_test import residual_structure
from identification.mismatch.name.naming import name
from identification.mismatch.unnamed.stage import Completed
from identification.mismatch.value import Value
from identification.physics.motor_lag import MotorLag
from identification.physics.zero_offset import ZeroOffset
from identification.recording import Acquisition
from tests.identification.diagnosed_runs import NOISE, C, dead_band
from tests.identification.mismatch.answer.answered import BAND, LEFT, SWEEP, draft, finding, told
from tests.identification.mismatch.small import known_noise, rng, selected, short

HELD = HeldOutRmse(1.0, 0.2, 0.2, "blocks of time")
EQUAL = policy.select.RIVALS_EQUAL_BIC


ROWS = list(
    product([None, LEFT], [(), (finding(),), (finding("a", EQUAL + 1),), (finding("a", EQUAL - 1),)], [None, SWEEP])
)


@pytest.mark.parametrize(("remainder", "findings", "experiment"), ROWS)
def test_the_verdict_by_table(remainder, findings, experiment):
    """Something left before all else; then rivals that do as well; then findings; else nothing is missing."""
    verdict = decided(findings, remainder, experiment, HELD)
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
    assert "Tried for it and refused: dead band (its parameter is not the same" in left.statement
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


def test_what_is_not_determined_is_told_by_what_it_is():
    """The instant of a jump, whose parameter is called `at`."""
    jump = ZeroOffset()
    data, estimate = known_noise({jump: (0.5, 40.0)}, [short(change=lambda t, _V, F: F + 0.5 * (t > 40.0))])
    (named,) = name(estimate, data, [])
    lost = finding_of(replace(named, std=(0.1, 1e9)), data.scale, {})
    assert lost.statement.endswith(
        "The data do not determine its instant: what is told here is one value of many that do as well."
    )
    assert lost.parameters["at"].told == "instant"
    known = finding_of(replace(named, std=(0.1, 0.2)), data.scale, {})
    assert "do not determine" not in known.statement


def test_what_the_samples_cannot_show_the_owner_of_is_something_quick():
    """A rotor that lags by 80 ms, in a recording whose times are known to 120."""
    recording = short(seconds=120.0, rate=25.0, change=lambda t, V, _F: C * np.abs(lagged(t, V)) * lagged(t, V))
    command, thrust = recording.channels
    vague = replace(thrust, acquisition=Acquisition(delay=0.0, delay_std=0.12))
    found, *_ = told(replace(recording, channels=(command, vague)), {MotorLag(): (0.08,)})
    assert found.verdict == "unexplained"
    statement = found.unexplained.statement
    assert statement.startswith("Something quick is left, of which the samples do not say whose it is: ")
    assert "ms, and the recording knows its own times to 120 ms: that may be the rotor's" in statement


def lagged(t, V, time_constant=0.08):
    """V behind a first-order lag, each sample's value held until the next."""
    x, share = np.zeros_like(V), 1.0 - np.exp(-(t[1] - t[0]) / time_constant)
    for i in range(1, V.size):
        x[i] = x[i - 1] + share * (V[i - 1] - x[i - 1])
    return x
