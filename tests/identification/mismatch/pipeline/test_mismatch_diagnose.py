"""Recordings in, diagnosis out: the right name, the right place, and nothing where nothing is."""

import json
from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.answer.as_json import diagnosis_json
from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.model.model import Model
from identification.mismatch.name.naming import checks
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.pipeline import diagnose
from identification.mismatch.prepare.preparing import Refusal, history_of
from identification.mismatch.select.baseline import baseline, start
from identification.mismatch.select.flatness import noise_goes_on
from identification.mismatch.select.forward_selection import search
from identification.mismatch.validate.held_out import Score
from identification.mismatch.validate.prediction import predicting, predicts, without_each, worse_predicted
from identification.mismatch.validate.train_test_split import train_test_split
from identification.mismatch.value import Where
from identification.physics.dead_band import DeadBand
from identification.physics.load_cell_saturation import LoadCellSaturation
from identification.physics.motor_lag import MotorLag
from identification.physics.time_skew import TimeSkew
from identification.physics.zero_offset import ZeroOffset
from identification.recording import Channel, Recording
from sim_devices import concealed
from tests.concealed.recordings import recordings
from tests.identification.diagnosed_runs import NOISE, TOP, C, dead_band, levels, run, table


def diagnosed(*runs, **how):
    found = diagnose(runs, **how)
    assert isinstance(found, Diagnosis), found
    return found


def effects(found):
    return {f.effect for f in found.findings}


def value(found, effect, name):
    (finding,) = [f for f in found.findings if f.effect == effect]
    return finding.parameters[name]


def within(estimate, true, sigmas=4.0, rel=0.0):
    assert abs(estimate.value - true) < sigmas * estimate.std + rel * abs(true), (estimate, true)
    assert 0 < estimate.std < 0.3 * abs(true)


# ---------------------------------------------------------------- concealed by the simulated bench


CONCEALED = [
    # effect, seed, plan, noise, (parameter of the finding, of the truth); seen by an oracle at 60 sigma
    ("dead_band", 2, "staircase", "mixed", ("half_width", "half_width")),
    ("motor_lag", 2, "staircase", "mixed", ("time_constant", "time_constant")),
    ("zero_offset", 1, "interleaved", "white", ("offset", "offset")),
    ("load_cell_saturation", 3, "random", "white", ("limit", "limit")),
    ("strut_drag", 1, "interleaved", "white", ("coefficient", "coefficient")),
    ("reversal_loss", 1, "interleaved", "white", ("loss", "loss")),
    ("heating", 3, "random", "white", None),
    ("load_cell_creep", 2, "staircase", "mixed", None),
    ("rotation_coupling", 3, "random", "white", None),
    ("supply_sag", 1, "interleaved", "white", None),
]


@pytest.mark.parametrize(("effect", "seed", "plan", "noise", "compared"), CONCEALED, ids=[c[0] for c in CONCEALED])
def test_what_the_bench_conceals_is_named(effect, seed, plan, noise, compared):
    rng = np.random.default_rng(seed)
    case = concealed.case(rng, [effect], 60.0, plan=plan, noise=noise, sampling=30.0, duration=240.0)
    found = diagnosed(*recordings(case))
    assert found.verdict == "explained"
    assert effects(found) == {effect}
    assert found.heldout.after < 0.97 * found.heldout.before
    assert found.heldout.after == pytest.approx(found.heldout.noise, rel=0.15)
    assert found.chi2_per_dof == pytest.approx(1.0, abs=0.1)
    assert found.unexplained is None
    assert found.mismatch
    (finding,) = found.findings
    assert finding.bic_gain > 100
    assert finding.p_value < 1e-12
    assert finding.probability > 0.9
    if compared:
        theirs = concealed.truth(case)["effects"][0]["parameters"][compared[1]]
        within(finding.parameters[compared[0]], theirs, rel=0.02)


@pytest.mark.parametrize("seed", range(8))
def test_nothing_is_found_where_nothing_is(seed):
    kind, noise = concealed.PLAN_KINDS[seed % 6], ("white", "mixed", "resonant", "heavy_tailed")[seed % 4]
    rng = np.random.default_rng(100 + seed)
    found = diagnosed(*recordings(concealed.case(rng, plan=kind, noise=noise, sampling=30.0, duration=150.0)))
    assert found.verdict == "adequate"
    assert (found.findings, found.mismatch, found.unexplained, found.next_experiment) == ((), (), None, None)
    assert found.model == found.baseline
    assert found.statement.startswith("Nothing is missing: C V|V|")


def test_zero_offset_on_sines_is_not_lost_in_slow_noise():
    """Ramps and sines, whose commands tick as fast as samples come, were once taken for tables of levels."""
    rng = np.random.default_rng(1)
    case = concealed.case(rng, ["zero_offset"], 60.0, plan="sine", noise="white", sampling=20.0, duration=150.0)
    assert effects(diagnosed(*recordings(case))) == {"zero_offset"}


# ---------------------------------------------------------------- one effect, two effects, several runs


@pytest.fixture(scope="module")
def dead():
    return diagnosed(run(volts=dead_band(1.5)))


def test_a_dead_band_is_measured(dead):
    assert dead.verdict == "explained"
    assert effects(dead) == {"dead_band"}
    within(value(dead, "dead_band", "half_width"), 1.5)
    assert dead.model_terms == ("dead_band",)
    within(dead.model["C"], C)
    within(dead.model["tare"], 1.5)
    assert abs(dead.baseline["C"].value - C) > 20 * dead.model["C"].std, "without the term C is wrong"
    assert "1.5 V" in dead.statement
    assert dead.train.after == pytest.approx(NOISE, rel=0.05)
    assert dead.whiteness_p > 1e-3
    for place in dead.mismatch:
        assert place.channel == "thrust"
        assert 0 < place.share <= 1
        assert place.where.low < place.where.high
        assert place.where.quantity in place.statement
    (curve,) = dead.curves
    assert np.std(curve.thrust - curve.baseline) > 5 * np.std(curve.thrust - curve.model)


def test_the_same_seed_gives_the_same_answer(dead):
    assert diagnosis_json(diagnosed(run(volts=dead_band(1.5)))) == diagnosis_json(dead)


def test_two_effects_are_both_named():
    found = diagnosed(run(lambda t, V, F: F + 2.0 * (t > 80), volts=dead_band(1.5)))
    assert found.verdict == "explained"
    assert effects(found) == {"dead_band", "zero_offset"}
    within(value(found, "dead_band", "half_width"), 1.5)
    within(value(found, "zero_offset", "offset"), 2.0)
    assert value(found, "zero_offset", "at").value == pytest.approx(80.0, abs=0.2)


def test_each_run_has_a_tare_of_its_own():
    one, two = run(seed=1, seconds=90.0, tare=5.0), run(seed=2, seconds=90.0, tare=-3.0)
    found = diagnosed(one, two)
    assert found.verdict == "adequate"
    assert found.recordings == (one.recording_id, two.recording_id)
    within(found.model[f"tare[{one.recording_id}]"], 5.0)
    within(found.model[f"tare[{two.recording_id}]"], -3.0)
    assert "tare" not in found.model


def test_a_parameter_that_differs_from_run_to_run_earns_no_name():
    found = diagnosed(run(seed=1, seconds=90.0, volts=dead_band(0.4)), run(seed=2, seconds=90.0, volts=dead_band(1.4)))
    assert found.verdict == "unexplained"
    assert "dead_band" not in effects(found)
    assert found.heldout.after > 5 * NOISE  # a flexible term may fit a part of it, a name does not
    assert found.heldout.after > 1.3 * found.heldout.noise


def test_held_out_runs_judge_both_models():
    kept = run(seed=3, volts=dead_band(1.5), tare=-4.0, seconds=90.0)
    found = diagnosed(run(volts=dead_band(1.5)), holdout=[kept])
    assert kept.recording_id in found.heldout.what
    assert found.heldout.before > 4 * found.heldout.after
    assert found.heldout.after == pytest.approx(NOISE, rel=0.1)
    other = diagnosed(run(volts=dead_band(1.5)), holdout=[run(seed=3, seconds=90.0)])
    assert other.heldout.after > 3 * other.heldout.noise, "a run without the effect is not described by it"


def test_of_several_runs_each_is_judged_by_the_others():
    """A zero of its own in each, and a dead band in all."""
    runs = [run(seed=seed, volts=dead_band(0.8), tare=float(seed)) for seed in range(3)]
    found = diagnose(runs)
    assert found.heldout.what.startswith("each run by a model fitted to the others")
    assert found.heldout.after == pytest.approx(NOISE, rel=0.03)
    assert found.heldout.before > 2 * NOISE


def test_a_short_run_judges_no_other():
    found = diagnose([run(seed=1, volts=dead_band(0.8)), run(seed=2, seconds=40.0, volts=dead_band(0.8))])
    assert found.heldout.what.startswith("every fourth of the blocks of time")


def test_a_hold_out_that_lies_is_found_and_put_right():
    lying = run(lambda t, V, F: -F, seed=2)
    found = diagnose([run(seed=1)], holdout=[lying])
    (fault,) = found.findings
    assert fault.effect == "channel_fault"
    assert lying.recording_id in fault.statement
    assert found.heldout.after < 1.1 * NOISE


def test_a_name_must_predict_what_was_not_fitted():
    found = diagnose([run(seed=1, volts=dead_band(0.8))], holdout=[run(seed=2)])
    assert found.verdict == "unexplained"
    assert any("predicted better without it" in text for text in found.unexplained.resembles)


def test_a_jump_of_one_run_need_not_be_in_another():
    found = diagnose([run(lambda t, V, F: F + 3.0 * (t > 75.0), seed=1)], holdout=[run(seed=2)])
    assert [f.effect for f in found.findings] == ["zero_offset"]


def test_blocks_kept_back_say_what_they_are(dead):
    assert "every fourth of the blocks of time" in dead.heldout.what
    assert dead.heldout.after == pytest.approx(NOISE, rel=0.1)


# ---------------------------------------------------------------- ambiguous, unexplained


@pytest.fixture(scope="module")
def uneven():
    return diagnosed(run(lambda _t, V, F: np.where(V < 0, 0.93, 1.0) * F))


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


@pytest.fixture(scope="module")
def bump():
    """15 % less at +8 V only: no term of the catalogue."""
    return diagnosed(run(lambda _t, V, F: F * (1 - 0.15 * ((V > 7) & (V < 9)))))


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
    assert all("alone explains nearly the same" in text for text in found.unexplained.resembles)


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
KNEE = (0.03, 30.0)
"""1/N, N: bend and onset."""


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
    assert "load_cell_saturation" not in {r.effect for r in drive.rivals}


def bent(*, cell):
    """Levels that a knee compresses by up to a third: of the cell, noise and all, or of what drives the rotor."""

    def compressed(value):
        bend, onset = KNEE
        e = np.clip(np.abs(value) - onset, 0.0, 1 / bend)
        return np.sign(value) * (np.minimum(np.abs(value), onset) + e - 0.5 * bend * e**2)

    runs = run(None if cell else lambda _t, _V, F: compressed(F), seconds=120.0, rate=20.0)
    command, thrust = runs.channels
    return replace(runs, channels=(command, replace(thrust, value=compressed(thrust.value)))) if cell else runs


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


# ---------------------------------------------------------------- other kinds of recording


def test_a_table_of_levels():
    clean = diagnosed(table(lambda v: C * v * np.abs(v)))
    assert clean.verdict == "adequate"
    assert "every fourth of the levels" in clean.heldout.what
    bent = diagnosed(table(lambda v: np.sign(v) * np.abs(v) ** 1.7))
    assert effects(bent) == {"exponent"}
    within(value(bent, "exponent", "exponent"), 1.7)
    assert bent.heldout.after < 0.1 * bent.heldout.before


def turning(volts):
    """V = n/2 + 0.0015 n|n|, in rev/s."""
    n = 2.0 * np.abs(volts)
    for _ in range(60):
        n = 2.0 * (np.abs(volts) - 0.0015 * n**2)
    return np.sign(volts) * n


def test_a_measured_rate_tells_winding_resistance_from_an_exponent():
    """V = n/k + r n|n|: thrust goes with n^2; written in steps of 0.1 N and in the order of its levels."""
    flat = table(lambda v: np.round(0.1 * turning(v) * np.abs(turning(v)), 1), number=161, noise=0.0)
    time, volts = flat.channels[1].time, flat.channels[0].value
    noise = 0.02 * np.random.default_rng(1).standard_normal(volts.size)
    rate = Channel("rate", "tachometer", "rotation_rate", "rev/s", time, turning(volts) + noise)
    found = diagnosed(replace(flat, channels=(*flat.channels, rate)))
    assert "winding_resistance" in found.model_terms
    assert "exponent" not in found.model_terms
    assert found.heldout.after < 0.03  # what rounding leaves


@pytest.mark.parametrize("measured", [True, False])
def test_a_measured_rate_makes_two_static_curves_of_one(measured):
    """Dead band and winding bend V to n, the blade n to thrust: three shapes on the curve of V to thrust are any."""
    flat = table(lambda v: blade(turning(dead_band(1.0)(v))), number=161, noise=0.05)
    time, volts = flat.channels[1].time, flat.channels[0].value
    noise = 0.02 * np.random.default_rng(1).standard_normal(volts.size)
    rate = Channel("rate", "tachometer", "rotation_rate", "rev/s", time, turning(dead_band(1.0)(volts)) + noise)
    found = diagnosed(replace(flat, channels=(*flat.channels, rate)) if measured else flat)
    assert (effects(found) == {"winding_resistance", "dead_band", "exponent"}) == measured
    if measured:
        within(value(found, "dead_band", "half_width"), 1.0)


def blade(n):
    """Reynolds: less than n^2."""
    return 0.2 * n * np.abs(n) ** 0.8


def rotation(seed, seconds, k=2.0, noise=0.01):
    start, level = levels(seed, seconds)
    t = np.arange(0.01, seconds - 0.5, 0.1)
    V = level[np.maximum(np.searchsorted(start, t, side="right") - 1, 0)]
    n = k * V + noise * np.random.default_rng([seed, 3]).standard_normal(t.size)
    return Channel("rotation_rate", "motor", "rotation_rate", "rev/s", t, n)


def test_thrust_by_the_measured_rate_alone():
    def wave(t):
        return 24 * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * t / 20))  # rev/s

    t, s = np.arange(0, 100, 0.1), np.arange(0.005, 99.9, 1 / 30)
    F = 0.125 * wave(s) * np.abs(wave(s)) + 1.0 + NOISE * np.random.default_rng(1).standard_normal(s.size)
    measured = (
        Channel("rotation_rate", "motor", "rotation_rate", "rev/s", t, wave(t)),
        Channel("thrust", "cell", "thrust", "N", s, F),
    )
    found = diagnosed(Recording("waves", "T1", measured))
    assert found.verdict == "adequate"
    assert found.baseline_model == "C n|n|"
    within(found.model["C"], 0.125, rel=1e-3)
    assert found.model["C"].unit == "N s^2/rev^2"


def test_a_rate_beside_the_command_is_a_response_too():
    found = diagnosed(run(seconds=100.0, extra=(rotation(0, 100.0),)))
    assert found.verdict == "adequate"
    assert found.model["C"].value == pytest.approx(C, rel=1e-3)


# ---------------------------------------------------------------- channel faults and lines


@pytest.mark.parametrize("lie", ["rescaled", "reversed"])
def test_a_channel_that_lies_is_the_finding_and_its_repair_is_told(lie):
    rng = np.random.default_rng(3)
    case = concealed.case(rng, lie=lie, sampling=30.0, duration=120.0, noise="white", plan="interleaved")
    found = diagnosed(*recordings(case))
    assert [(f.effect, f.form) for f in found.findings] == [("channel_fault", lie)]
    assert found.verdict == "explained"
    assert case.fault["channel"] in found.findings[0].statement
    assert any("put right" in note for note in found.notes)


@pytest.mark.parametrize(
    ("form", "channels"), [("frequency", ["rotation_rate"]), ("blades", ["rotation_rate"]), ("blades", [])]
)
def test_a_periodic_disturbance_is_a_finding_with_its_frequency(form, channels):
    rng = np.random.default_rng(3)
    how = {"forms": [form], "channels": channels, "noise": "white", "plan": "interleaved"}
    case = concealed.case(rng, ["periodic_disturbance"], 60.0, sampling=60.0, duration=120.0, **how)
    found = diagnosed(*recordings(case))
    assert effects(found) == {"periodic_disturbance"}
    assert "periodic_disturbance" in found.model_terms
    line, true = found.findings[0].parameters, case.effects[0].parameters
    assert line["amplitude"].value == pytest.approx(true["amplitude"], rel=0.2)
    if form == "blades" and channels:
        assert line["periods_per_turn"].value == pytest.approx(true["blades"], rel=1e-3)
    elif form == "blades":
        turns = true["blades"] * case.scale.rate / case.scale.voltage
        assert line["periods_per_volt_second"].value == pytest.approx(turns, rel=1e-3)
        assert line["periods_per_volt_second"].unit == "1/(V s)"
    else:
        assert line["frequency"].value == pytest.approx(true["frequency"], rel=1e-4)


# ---------------------------------------------------------------- refusals


def refused(*runs, **how):
    found = diagnose(runs, **how)
    assert isinstance(found, Refusal)
    return found.reason


def test_what_cannot_be_diagnosed_together_is_refused():
    a, b = run(seconds=60.0), run(seed=1, seconds=60.0)
    t3 = run(seed=1, seconds=60.0, thruster="T3")
    assert refused() == "no recording was given"
    assert refused(a, t3) == "recordings of several thrusters (T1, T3); diagnose one at a time"
    assert refused(a, b, a) == "the same recording was given twice"
    assert "hold out a recording of T1" in refused(a, holdout=[t3])
    by_rate = replace(run(seed=1, extra=(rotation(1, 100.0),)), recording_id="rate")
    by_rate = replace(by_rate, channels=by_rate.channels[1:])
    assert "driven by different quantities" in refused(a, by_rate)
    silent = replace(b, channels=b.channels[:1])
    assert "run-1.h5 has no thrust channel" in refused(a, silent)
    assert "run-1.h5 has no thrust channel" in refused(a, holdout=[silent])
    short = replace(
        a, channels=(a.channels[0], Channel("thrust", "cell", "thrust", "N", np.arange(8) / 2, np.arange(8.0)))
    )
    assert "8 thrust samples" in refused(short)


def test_what_was_fitted_is_not_held_out():
    a = run(seconds=60.0)
    assert "held out" in refused(a, holdout=[a])


# ---------------------------------------------------------------- the contract


def no_nan(node):
    if isinstance(node, dict):
        return all(map(no_nan, node.values()))
    if isinstance(node, list):
        return all(map(no_nan, node))
    return node is None or isinstance(node, bool | str | int) or bool(np.isfinite(node))


@pytest.mark.parametrize("which", ["dead", "uneven"])
def test_the_json_holds_what_the_contract_promises(which, request):
    told = json.loads(json.dumps(diagnosis_json(request.getfixturevalue(which)), allow_nan=False))
    assert no_nan(told)
    assert (told["format"], told["version"]) == ("thruster-rig-diagnosis", 1)
    assert told.keys() >= {
        *("recordings", "thruster", "verdict", "statement", "baseline", "mismatch", "findings", "unexplained"),
        *("model", "fit", "next_experiment", "notes"),
    }
    assert told["verdict"] in ("adequate", "explained", "ambiguous", "unexplained")
    assert told["baseline"]["model"] == "C V|V|"
    assert told["baseline"]["parameters"]["C"].keys() == {"value", "std", "low", "high", "unit"}
    for place in told["mismatch"]:
        assert place.keys() >= {"channel", "where", "share", "p_value", "statement"}
        assert place["where"].keys() >= {"quantity", "from", "to"}
    (finding,) = told["findings"]
    assert finding.keys() >= {
        *("effect", "statement", "parameters", "p_value", "bic_gain", "probability", "rivals"),
    }
    assert all(p.keys() == {"value", "std", "low", "high", "unit"} for p in finding["parameters"].values())
    assert all(p["low"] <= p["value"] <= p["high"] for p in finding["parameters"].values())
    assert all(isinstance(rival, str) for rival in finding["rivals"])
    assert [r["effect"] for r in finding["rival_details"]] == finding["rivals"]
    assert told["fit"].keys() >= {"train", "heldout", "chi2_per_dof", "whiteness_p"}
    assert told["fit"]["train"].keys() >= {"rmse_before", "rmse_after"}
    assert told["fit"]["heldout"].keys() >= {"rmse_before", "rmse_after", "noise", "what"}
    if told["verdict"] == "ambiguous":
        steps = told["next_experiment"]["steps"]
        assert steps
        assert all(abs(s["command_voltage"]) <= TOP and s["duration"] > 0 for s in steps)
        assert 0 <= told["next_experiment"]["expected_power"] <= 1


def test_numbers_that_are_not_finite_become_null(dead):
    strange = replace(
        dead,
        whiteness_p=float("nan"),
        chi2_per_dof=float("inf"),
        mismatch=(replace(dead.mismatch[0], where=Where("time", -np.inf, 3.0, "s")),),
    )
    told = diagnosis_json(strange)
    assert told["fit"]["whiteness_p"] is None
    assert told["fit"]["chi2_per_dof"] is None
    assert told["mismatch"][0]["where"] == {"quantity": "time", "from": None, "to": 3.0, "unit": "s"}
    json.dumps(told, allow_nan=False)


def test_unexplained_is_told_with_its_table(bump):
    told = json.loads(json.dumps(diagnosis_json(bump), allow_nan=False))
    left = told["unexplained"]
    assert left.keys() >= {"where", "share", "p_value", "shape", "statement", "resembles"}
    assert all(row.keys() == {"at", "residual", "std"} for row in left["shape"])
    assert 0 < left["share"] <= 1


# ---------------------------------------------------------------- what has no name must predict


def unnamed(recording, term, values):
    """The model that `predicting` leaves of C V|V| with one term whose name was not earned."""
    found = search((history_of(recording),), np.random.default_rng(0))
    first = found.before.fit
    fitted = fit(*first.more(term, values), found.data, found.before.weights)
    after = replace(found.before, fit=fitted)
    return predicting(after, train_test_split(after, found.data, ()), found.data, found.terms, [term], ())


def test_a_term_without_a_name_stays_where_it_predicts():
    after = unnamed(run(volts=dead_band(0.8)), DeadBand(), (0.5,))
    assert [t.id for t in after.fit.model.terms] == ["dead_band"]


def test_a_term_without_a_name_goes_where_it_only_describes():
    """The zero is back where it was in the last block of time, which judges."""
    knocked = run(lambda t, _V, F: F + 3.0 * ((t > 128.0) & (t < 144.0)))
    after = unnamed(knocked, ZeroOffset(), (3.0, 128.0))
    assert after.fit.model.terms == ()


@pytest.fixture(scope="module")
def late():
    """Selected in a run with a dead band whose force comes late."""
    return search(
        (history_of(run(lambda t, _V, F: np.interp(t - 0.2, t, F), volts=dead_band(0.8))),), np.random.default_rng(0)
    )


def judged(split, chi2, rmse):
    """The same, whose models have these scores where they lack a term."""
    every = len(split.estimate.fit.model.terms)
    return replace(
        split,
        judge=lambda fitted: Score(1.0, 100.0) if len(fitted.model.terms) == every else Score(rmse, chi2),
    )


def worse(split, terms, *, same_run):
    return worse_predicted(without_each(split, terms, same_run=same_run), same_run=same_run)


def test_a_clock_of_one_run_is_not_that_of_another(late):
    assert {t.id for t in late.after.fit.model.terms} == {"dead_band", "time_skew"}
    better = judged(train_test_split(late.after, late.data, ()), 50.0, 0.9)
    terms = late.after.fit.model.terms
    assert {t.id for t in worse(better, terms, same_run=True)} == {
        "dead_band",
        "time_skew",
    }
    assert {t.id for t in worse(better, terms, same_run=False)} == {"dead_band"}


def test_of_other_runs_the_error_must_fall_as_well(late):
    quieter = judged(train_test_split(late.after, late.data, ()), 50.0, 1.1)
    terms = late.after.fit.model.terms
    assert worse(quieter, terms, same_run=False) == ()
    assert len(worse(quieter, terms, same_run=True)) == 2


def test_what_predicts_is_better_than_the_baseline(late):
    assert predicts(late.after, late.before, late.data, ())
    assert not predicts(late.before, late.after, late.data, ())
