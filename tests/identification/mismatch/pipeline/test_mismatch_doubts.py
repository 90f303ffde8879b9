"""Recordings in, diagnosis out: ambiguous, unexplained but located, doubted."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.estimate.fitting import fit
from identification.mismatch.model.model import Model
from identification.mismatch.name.naming import checks
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.select.baseline import baseline, start
from identification.mismatch.select.limits.flatness import noise_goes_on
from identification.physics.load_cell_saturation import LoadCellSaturation
from identification.physics.motor_lag import MotorLag
from identification.physics.time_skew import TimeSkew
from identification.recording import Channel, Recording
from tests.identification.diagnosed_runs import NOISE, C, dead_band, run, table
from tests.identification.mismatch.pipeline.whole_diagnoses import KNEE, bent, diagnosed, effects, within


def test_asymmetry_and_torque_cannot_be_told_apart(uneven):
    """At levels of one sign each both are a factor."""
    assert uneven.verdict == "ambiguous"
    (finding,) = uneven.findings
    assert {finding.effect, *(r.effect for r in finding.rivals)} == {"asymmetry", "torque_crosstalk"}
    assert finding.probability == pytest.approx(0.5, abs=0.05)
    (rival,) = finding.rivals
    assert abs(rival.bic_loss) < 1.0
    known = {finding.effect: finding.parameters, rival.effect: rival.parameters}
    within(known["asymmetry"]["ratio"], 0.93)
    assert known["torque_crosstalk"]["coefficient"].value == pytest.approx(0.5 * C * 0.07, rel=0.1)
    assert uneven.next_experiment is not None
    assert {"asymmetry", "torque_crosstalk"} <= set(uneven.next_experiment.why.replace(":", " ").split())
    assert "cannot tell" in uneven.statement
    assert 0.0 <= uneven.next_experiment.expected_power <= 1.0


def test_a_bump_at_one_level_is_located(bump):
    found = bump
    assert found.verdict == "unexplained"
    assert found.findings == ()
    first = found.mismatch[0]
    assert first.where.quantity == "command_voltage"
    assert (first.where.low, first.where.high) == pytest.approx((7.0, 9.0))
    left = found.unexplained
    assert left.where.quantity == "command_voltage"
    assert left.where.low <= 7.0 < 9.0 <= left.where.high
    assert left.p_value < 1e-6
    shape = {round(at): mean for at, mean, _ in left.shape}
    assert shape[8] == min(shape.values())
    assert "no term of the catalogue" in found.statement


def test_a_gain_that_comes_and_goes_is_located_in_time():
    found = diagnosed(run(lambda t, _V, F: F * (1 + 0.02 * np.sin(2 * np.pi * t / 40)), seconds=120.0, rate=20.0))
    assert found.verdict == "unexplained"
    assert found.mismatch[0].where.quantity == "time"
    assert found.unexplained.where.quantity == "time"


def test_doubts_say_why_a_name_is_not_earned():
    """A dead band that doubles half-way."""

    def grown(t, V, _F):
        V = np.sign(V) * np.maximum(np.abs(V) - np.where(t < 75, 0.5, 1.0), 0.0)
        return C * V * np.abs(V)

    found = diagnosed(run(grown, rate=20.0))
    assert found.verdict == "unexplained"
    assert effects(found) == set()
    assert any("not the same in both halves" in text for text in found.unexplained.resembles)
    assert found.heldout.after < 0.5 * found.heldout.before, "the fit is better all the same"


def test_two_shapes_that_repair_each_other_are_no_names():
    """An exponent that is in no catalogue: either of two other shapes explains most, both together all of it."""
    bent = table(lambda v: 0.6 * np.sign(v) * np.abs(v) ** 1.9, number=161, noise=0.1)
    found = diagnosed(bent, without=("exponent",))
    assert (found.verdict, effects(found)) == ("unexplained", set())
    assert found.unexplained.where.quantity == "command_voltage"
    assert len(found.unexplained.resembles) == 2
    assert all("mend each other" in text for text in found.unexplained.resembles)


def test_two_shapes_that_each_explain_a_part_are_named():
    def both(v):
        V = np.clip(dead_band(1.5)(v), -10.0, 10.0)
        return C * V * np.abs(V)

    found = diagnosed(table(both, number=161))
    assert found.unexplained is None
    assert {frozenset({f.effect, *(r.effect for r in f.rivals)}) for f in found.findings} == {
        frozenset({"dead_band"}),
        frozenset({"command_saturation", "load_cell_saturation"}),
    }


LIMIT = 66.0
"""N"""


def clipping(*, cell):
    """Levels of which the highest meet a limit, N: of the cell, which clips noise and all, or of the drive."""
    runs = run(None if cell else lambda _t, _V, F: np.clip(F, -LIMIT, LIMIT), seconds=120.0, rate=20.0)
    command, thrust = runs.channels
    clipped = replace(thrust, value=np.clip(thrust.value, -LIMIT, LIMIT))
    return replace(runs, channels=(command, clipped)) if cell else runs


def test_readings_are_flat_where_a_cell_clips():
    (cell,) = diagnosed(clipping(cell=True)).findings
    assert (cell.effect, cell.rivals) == ("load_cell_saturation", ())
    (drive,) = diagnosed(clipping(cell=False)).findings
    assert drive.effect == "command_saturation"
    assert ("load_cell_saturation", "hard") not in {(r.effect, r.form) for r in drive.rivals}


@pytest.mark.parametrize("cell", [True, False])
@pytest.mark.parametrize(("made", "form", "values"), [(clipping, "hard", (LIMIT,)), (bent, "knee", KNEE)])
def test_a_cell_that_is_said_to_clip_is_doubted_where_the_noise_goes_on(made, form, values, cell):
    data, theta = start([history_of(made(cell=cell))])
    state = baseline(data, theta, (), Model())
    clips = LoadCellSaturation(form)
    model = Model((clips,))
    found = replace(state, fit=fit(model, replace(state.fit.theta, terms=(values,)), data, state.weights))
    white = replace(found, noise=Noise(NOISE**2, 0.0))
    assert noise_goes_on(white.fit, clips, white.noise, data) != cell
    assert ("the noise goes on" in " ".join(check.failed for check in checks(white, clips, data, 1))) != cell


def test_a_lag_and_a_lead_that_undo_each_other_are_doubted():
    t = np.arange(0.0, 120.0, 0.05)
    volts = 10.0 * np.sin(2 * np.pi * t / 20)
    force = C * volts * np.abs(volts) + 0.3 * np.random.default_rng(6).standard_normal(t.size)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", t + 0.001, volts),
        Channel("thrust", "cell", "thrust", "N", t, force),
    )
    data, theta = start([history_of(Recording("sine", "T1", channels, source="sine.h5"))])
    state = baseline(data, theta, (), Model())
    lag, skew = MotorLag("first_order"), TimeSkew()

    def said(delay):
        model = Model().plus(lag).plus(skew)
        values = {lag: (0.3,), skew: (delay,)}
        at = replace(state.fit.theta, terms=tuple(values[t] for t in model.terms))
        known = replace(state, fit=replace(fit(model, at, data, state.weights, most_steps=0), theta=at))
        return " ".join(check.failed for check in checks(known, lag, data, 2))

    assert "time_skew nearly cancel" in said(-0.3)
    assert "cancel" not in said(0.3)
