"""A saved model as a baseline, what it predicts, and a simulation against the real run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.flexible_terms.flexible import Flexible
from identification.mismatch import policy
from identification.mismatch.answer.against_twin import twin_of
from identification.mismatch.compare.saved_model_baseline import given, lasting, prior_factor, starting
from identification.mismatch.compare.simulation import (
    Drive,
    Prediction,
    drawn,
    held,
    others_of,
    simulate,
    wave_notes,
)
from identification.mismatch.comparison import compare, sample_noise
from identification.mismatch.estimate.fitting import raw
from identification.mismatch.model.model import Model
from identification.mismatch.prepare.preparing import Refusal
from identification.physics.asymmetry import Asymmetry
from identification.physics.dead_band import DeadBand
from identification.physics.motor_lag import MotorLag
from identification.physics.speed_of_advance import SpeedOfAdvance
from identification.physics.winding_resistance import WindingResistance
from identification.physics.zero_offset import ZeroOffset
from identification.recording import Channel
from identification.twin import Alternative, TwinLine, TwinNoise
from tests.identification.diagnosed_runs import NOISE, dead_band
from tests.identification.mismatch.small import data_of, known_noise, rng, short

BAND, UNEVEN = DeadBand(), Asymmetry()


@pytest.fixture(scope="module")
def twin():
    recording = short(change=lambda _t, _V, F: np.where(F < 0, 0.85, 1.0) * F, volts=dead_band(1.2))
    data, estimate = known_noise({BAND: (1.0,), UNEVEN: (1.0,)}, [recording])
    return twin_of(estimate, data, [recording], None)


def static(twin, V):
    """The twin's static curve, written anew."""
    values = {t.effect: t.values[0] for t in twin.terms}
    x = np.sign(V) * np.maximum(np.abs(V) - values["dead_band"], 0.0)
    return twin.C * x * np.abs(x) * np.where(x < 0, values["asymmetry"], 1.0)


def with_values(twin, values):
    names = [next(iter(t.parameters)) for t in twin.terms]
    moved = [replace(t, parameters={n: v}) for t, n, v in zip(twin.terms, names, values, strict=True)]
    return replace(twin, terms=tuple(moved))


# ---------------------------------------------------------------- what it predicts


def test_it_predicts_its_own_curve_of_any_drive(twin):
    drive = Drive(np.array([1.0, 3.0, 6.0]), np.array([5.0, -9.0, 0.0]))
    times = np.arange(0.05, 8.0, 0.1)
    found = simulate(twin, drive, times)
    assert isinstance(found, Prediction)
    V = held(drive, times)
    assert found.thrust == pytest.approx(static(twin, V), abs=1e-6)
    assert found.rate is None
    straight = replace(drive, stepwise=False)
    assert held(straight, np.array([2.0])).tolist() == [-2.0]
    assert held(drive, np.array([0.5, 1.0, 2.9])).tolist() == [0.0, 5.0, 5.0]


def test_a_lag_is_seen_between_coarse_samples():
    """Samples 0.5 s apart of a rotor of 80 ms: intervals in between are fine."""
    data, estimate = known_noise({MotorLag("first_order"): (0.08,)}, [short()])
    lagging = twin_of(estimate, data, [short()], None)
    tau = lagging.terms[0].values[0]
    found = simulate(lagging, Drive(np.array([0.0, 1.03]), np.array([0.0, 8.0])), np.array([0.6, 1.1, 1.6]))
    x = 8.0 * (1 - np.exp(-(1.1 - 1.03) / tau)) if tau > 1e-6 else 8.0
    assert found.thrust[1] == pytest.approx(lagging.C * x**2, rel=0.05)
    assert found.thrust[2] == pytest.approx(lagging.C * 64.0, rel=0.01)


def test_what_it_looks_at_must_be_given():
    t = np.arange(0.0, 80.0, 0.5)
    flow = Channel("u", "u", "flow_speed", "m/s", t, 0.3 + 0.2 * np.sin(t / 7))
    run = short(extra=(flow,))
    term = SpeedOfAdvance()
    data, _ = data_of([run])
    data, estimate = known_noise({term: term.trials(data.scale)[0]}, [run])
    wet = twin_of(estimate, data, [run], None)
    drive = Drive(np.array([0.0]), np.array([8.0]))
    assert "needs flow_speed, which is not given" in simulate(wet, drive, t).reason
    others = others_of(run)
    assert others.keys() == {"flow_speed"}
    assert isinstance(simulate(wet, replace(drive, others=others), t), Prediction)


def test_lines_are_waves_in_time_and_of_the_rotor_silent_at_rest(twin):
    fixed = TwinLine(2.0, 0.1, 4.0, 0.01, phase=0.5)
    rotor = TwinLine(1.0, 0.1, 30.0, 0.01, ratio=2.0, turns="V s")
    humming = replace(twin, lines=(fixed, rotor))
    drive = Drive(np.array([0.0, 4.0]), np.array([6.0, 0.0]))
    times = np.arange(0.02, 8.0, 0.02)
    found = simulate(humming, drive, times).thrust - simulate(twin, drive, times).thrust
    turned = 6.0 * np.minimum(times, 4.0)
    expected = 2 * np.sin(2 * np.pi * 4 * times + 0.5) + np.where(times < 4.0, np.sin(2 * np.pi * 2 * turned), 0.0)
    near = np.abs(times - 4.0) > 0.05
    offset = (found - expected)[near & (times > 0.5)]
    assert np.std(offset) < 0.8, "the rotor's angle is counted from the first sample"
    late = times > 4.1
    assert found[late] == pytest.approx(2 * np.sin(2 * np.pi * 4 * times[late] + 0.5), abs=1e-6)
    notes = wave_notes(humming)
    assert notes[0] == "A line of 2 N at 4 Hz is in it (phase of the first recording's clock)."
    assert notes[1] == "A line of 1 N at 2 periods per V s is in it (its phase is not known: 0 here)."


def test_noise_has_the_law_it_says():
    """Variance and correlation of each part, over 60,000 samples."""
    noise = TwinNoise(0.3, 0.0, (0.5,), (1.0,), ((3.0, 4.0),), (0.6,))
    x = drawn(noise, np.zeros(60_000), 0.02, rng(1))
    lags = np.arange(1, 40)
    found = np.array([np.mean(x[k:] * x[:-k]) for k in lags])
    w = 2 * np.pi * 3.0
    root = np.sqrt(1 - 1 / 64)
    t = lags * 0.02
    expected = np.exp(-t / 0.5) + 0.6 * np.exp(-w * t / 8) * (np.cos(w * root * t) + np.sin(w * root * t) / (8 * root))
    assert np.var(x) == pytest.approx(1.9, rel=0.08)
    assert found == pytest.approx(expected, abs=0.12)
    loud = drawn(TwinNoise(0.0, 0.01), np.full(20_000, 30.0), 0.1, rng(2))
    assert np.std(loud) == pytest.approx(3.0, rel=0.03)


# ---------------------------------------------------------------- as a baseline


def test_its_terms_are_given_and_its_constant_begins_the_fit(twin):
    data, theta = data_of([short()])
    begun, at, model = starting(twin)(data, theta)
    assert at.C == twin.C
    assert model.terms == ()
    assert [g.values for g in model.given] == [t.values for t in twin.terms]
    thrust, _ = raw(model, at, begun, with_rate=False)
    h, r = data.histories[0], data.rows[0]
    assert thrust[0] - at.tares[0] == pytest.approx(static(twin, h.driver[r]), abs=1e-6)
    assert begun.prior_factor is not None


def test_its_uncertainty_is_that_of_its_parameters_by_differences(twin):
    """Columns times their transpose: the covariance of its prediction, C aside."""
    data, theta = data_of([short()])
    theta = replace(theta, C=twin.C)
    cov = np.array(twin.covariance)
    cov[1, 2] = cov[2, 1] = -0.9 * np.sqrt(cov[1, 1] * cov[2, 2])
    twin = replace(twin, covariance=tuple(map(tuple, cov.tolist())))
    found, cov = prior_factor(twin, data, theta), cov[1:, 1:]
    V = data.histories[0].driver[data.rows[0]]
    values = np.array([t.values[0] for t in twin.terms])
    slopes = []
    for step in 1e-5 * np.eye(2):
        high, low = (static(with_values(twin, values + sign * step), V) for sign in (1, -1))
        slopes.append((high - low) / 2e-5)
    J = np.column_stack(slopes)
    neutral = [
        static(with_values(twin, [0.0 if i == 0 else values[0], 1.0 if i == 1 else values[1]]), V) for i in (0, 1)
    ]
    beside = np.column_stack([static(twin, V) - each for each in neutral])
    alone = 1.0 / np.sqrt(np.diag(np.linalg.inv(cov)))
    own = alone / np.abs(values - [0.0, 1.0])
    assert np.all(own < policy.compare.FORM_ERROR), "no more off than its own run tells where all else is known"
    shapes = beside * own
    forms = shapes @ shapes.T
    expected = J @ cov @ J.T + forms
    assert found.thrust[0] @ found.thrust[0].T == pytest.approx(expected, abs=2e-2 * np.max(expected))
    sure = replace(twin, covariance=tuple((0.0,) * 3 for _ in range(3)))
    thrust = prior_factor(sure, data, theta).thrust[0]
    band = policy.compare.FORM_ERROR**2 * np.outer(beside[:, 0], beside[:, 0])
    assert thrust @ thrust.T == pytest.approx(band, abs=2e-2 * np.max(band)), "a form of several may be off"
    bare = replace(twin, terms=(), covariance=((1.0,),))
    assert prior_factor(bare, data, theta) is None
    assert given(bare) == ()
    assert isinstance(starting(bare)(data, theta)[2], Model)


def test_what_a_term_changes_of_rate_and_thrust_goes_together():
    """Behind a winding a rotor is slower than its driver says. By the rate per driver of a first look, 19 % too small,
    a lag that was known to 0.2 ms had moved the thrust so far and the rate less: 2 of its errors were told as a change
    of 7 sigma."""
    taken = WindingResistance()
    made = short(volts=lambda V: 2 * V / (1 + np.sqrt(1 + 4 * 0.03 * np.abs(V))))
    rated = replace(made, channels=(*made.channels, _turning(made, 0.03)))
    data, estimate = known_noise({taken: (0.03,)}, [rated])
    twin = twin_of(estimate, data, [rated], None)
    begun, theta = data_of([rated])
    assert theta.k < 0.9 * twin.rate_per_driver
    begun, theta, _ = starting(twin)(begun, theta)
    assert theta.k == twin.rate_per_driver
    std = np.sqrt(twin.covariance[1][1])
    values = twin.terms[0].parameters["loss"]
    moved = replace(twin, terms=(replace(twin.terms[0], parameters={"loss": values + std}),))
    change = _by(moved, begun, theta) - _by(twin, begun, theta)
    column = np.concatenate([begun.prior_factor.thrust[0][:, 0], begun.prior_factor.rate[0][:, 0]])
    assert column == pytest.approx(change, abs=0.02 * np.max(np.abs(change)))


def _turning(recording, taken):
    t = np.arange(0.05, 80.0, 0.05)
    V = np.nan_to_num(recording.channels[0].held_at(t))
    n = 2 * V / (1 + np.sqrt(1 + 4 * taken * np.abs(V)))
    return Channel("rotation_rate", "drive", "rotation_rate", "rev/s", t, 1.8 * n)


def _by(twin, data, theta):
    thrust, rate = raw(Model((), given(twin)), theta, data, with_rate=True)
    return np.concatenate([thrust[0], rate[0]])


# ---------------------------------------------------------------- a simulation against a recording


def simulated(change=None, seed=7, **how):
    """The same plan without noise."""
    return replace(short(change=change, noise=0.0, tare=0.0, **how), recording_id=f"sim-{seed}", source="sim.h5")


def refused(simulation, real):
    found = compare(simulation, real)
    assert isinstance(found, Refusal), found
    return found.reason


def test_what_was_not_simulated_alike_is_refused():
    real = short()
    thrust = real.channels[1]
    other = simulated()
    rate = Channel("n", "n", "rotation_rate", "rev/s", thrust.time, np.sin(thrust.time))
    assert "both need the same one" in refused(replace(other, channels=(rate, other.channels[1])), real)
    begun = Channel("thrust", "cell", "thrust", "N", thrust.time[:80], thrust.value[:80])
    short_one = replace(other, channels=(other.channels[0], begun))
    assert "simulate the whole run" in refused(short_one, real)
    elsewhere = replace(other.channels[0], value=np.roll(other.channels[0].value, 3))
    assert "was not driven as run-0.h5 was" in refused(replace(other, channels=(elsewhere, other.channels[1])), real)
    silent = replace(other, channels=other.channels[:1])
    assert "has no thrust channel" in refused(silent, real)


def test_noise_of_a_sample_is_seen_beside_levels():
    _, thrust = short(rate=40.0).channels
    assert sample_noise(thrust) == pytest.approx(NOISE, rel=0.12)
    assert sample_noise(replace(thrust, value=np.round(0.0 * thrust.value))) == 0.0


def test_physics_that_the_simulation_leaves_out_is_the_finding():
    """Simulated without, measured with a dead band; its clock is four seconds early."""
    real = short(volts=dead_band(1.2))
    plain = simulated()
    early = replace(plain, channels=tuple(replace(c, time=c.time - 4.0) for c in plain.channels))
    found = compare(early, real)
    assert {f.effect for f in found.real.findings} == {"dead_band"}
    assert found.simulation.verdict == "adequate"
    assert found.offset == pytest.approx(-4.0, abs=0.02)
    assert any("Its clock was moved" in note for note in found.real.notes)
    assert found.real.baseline_model.startswith("the simulation sim.h5")
    (finding,) = found.real.findings
    assert finding.parameters["half_width"].value == pytest.approx(1.2, abs=0.05)


# ---------------------------------------------------------------- what of it is true of another run


def test_a_jump_of_the_zero_stays_with_the_run_that_had_it():
    jump = ZeroOffset()
    data, estimate = known_noise({BAND: (1.0,), jump: (2.0, 40.0)}, [short(volts=dead_band(1.0))])
    twin = twin_of(estimate, data, [short(volts=dead_band(1.0))], None)
    assert [t.effect for t in twin.terms] == ["dead_band", "zero_offset"]
    other = short(seed=3)
    left = lasting(twin, [other])
    assert [t.effect for t in left.terms] == ["dead_band"]
    assert left.names == ("C", "dead_band.half_width")
    assert np.array(left.covariance) == pytest.approx(np.array(twin.covariance)[:2, :2])
    own = replace(other, recording_id=twin.sources[0].recording_id)
    assert lasting(twin, [own]) is twin
    assert lasting(left, [other]) is left


def test_a_free_shape_over_time_stays_with_the_run_that_had_it():
    """It says so itself, and was subtracted from the next run all the same."""
    over_time = Flexible("time", "s", (0.0, 20.0, 40.0, 60.0), (0,), ("force",))
    over_loads = replace(over_time, quantity="load_history", unit="1", knots=(0.0, 0.3, 0.6, 1.0), memory=5.0)
    values = {over_time: (0.1, -0.1, 0.1), over_loads: (0.1, 0.2, 0.1)}
    data, estimate = known_noise(values, [short(volts=dead_band(1.0))])
    twin = twin_of(estimate, data, [short(volts=dead_band(1.0))], None)
    assert [t.effect for t in lasting(twin, [short(seed=3)]).terms] == ["flexible:load_history"]


def test_what_another_form_would_have_said_is_a_direction_no_longer_than_it_was_off(twin):
    data, theta = data_of([short()])
    theta = replace(theta, C=twin.C)
    terms = tuple(replace(t, form="jump") if t.effect == "dead_band" else t for t in twin.terms)
    plain = prior_factor(twin, data, theta).thrust[0]
    near, far = (
        prior_factor(replace(twin, alternatives=(Alternative(twin.C, terms, loss, 0.0),)), data, theta).thrust[0]
        for loss in (1.0, 900.0)
    )
    told = [np.sum(each**2) - np.sum(plain**2) for each in (near, far)]
    assert told[0] > 0
    assert told[1] == pytest.approx(told[0] * (policy.compare.FORM_ERROR_SIGMA / 30) ** 2, rel=1e-6)
