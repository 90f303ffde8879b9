"""Forms of stand and load cell against their formulas, ramps through a limit or a knee among them."""

from dataclasses import replace

import numpy as np
import pytest

from identification.run_history import filters
from tests.identification.physics.one_term import H, S, base, term
from tests.identification.physics.runs_on_intervals import moment


def test_stand_forms_use_their_filters():
    T = base()
    m = moment(H, S)
    assert np.array_equal(term("hysteresis").apply(T, m, (2.0,)), filters.play(T, 2.0))
    rung = filters.resonant(T, H.dt, 3.0, 0.1)
    assert term("stand_resonance").apply(T, m, (0.5, 3.0, 0.1)) == pytest.approx(0.5 * (T + rung))
    assert term("time_skew").apply(T, m, (0.3,)) == pytest.approx(filters.delayed(T, H.edges, 0.3))


def test_a_force_before_its_command_is_no_amplifier():
    skew = term("time_skew")
    assert "24.1 ms after the command that causes it" in skew.statement((0.0241,), S)
    assert "an amplifier that smooths" in skew.statement((0.0241,), S)
    early = skew.statement((-0.0241,), S)
    assert "comes 24.1 ms before the command that causes it, so the clocks differ" in early
    assert "amplifier" not in early


def test_a_clipping_cell_shows_the_mean_of_samples_that_clip_one_by_one():
    """Monte Carlo of noisy samples round the limit, tare and all."""
    value = np.linspace(-110.0, 110.0, 41)
    s = replace(S, noise=4.0)
    still = np.zeros(41)
    got = term("load_cell_saturation").apply(value, moment(H, s, tare=7.0, x=still), (90.0,))
    noise = 4.0 * np.random.default_rng(9).standard_normal((41, 40_000))
    expected = np.clip(value[:, None] + 7.0 + noise, -90.0, 90.0).mean(axis=1) - 7.0
    assert got == pytest.approx(expected, abs=5 * 4.0 / 200)
    assert not np.allclose(got, np.clip(value + 7.0, -90.0, 90.0) - 7.0, atol=0.5), "the bend at the limit is rounded"
    hard = term("load_cell_saturation").apply(value, moment(H, replace(S, noise=0.0), tare=7.0, x=still), (90.0,))
    assert hard == pytest.approx(np.clip(value + 7.0, -90.0, 90.0) - 7.0)


def test_conversions_that_clip_one_by_one_before_their_mean_is_taken():
    """Monte Carlo: the samples' own noise is small, that of the conversions is not."""
    value = np.linspace(-110.0, 110.0, 41)
    form, still = term("load_cell_saturation", "averaged"), np.zeros(41)
    got = form.apply(value, moment(H, replace(S, noise=0.5), tare=7.0, x=still), (90.0, 5.0))
    noise = 5.0 * np.random.default_rng(3).standard_normal((41, 40_000))
    expected = np.clip(value[:, None] + 7.0 + noise, -90.0, 90.0).mean(axis=1) - 7.0
    assert got == pytest.approx(expected, abs=5 * 5.0 / 200)
    passed = (np.abs(value[:, None] + 7.0 + noise) < 90.0).mean(axis=1)
    assert form.slope(value + 7.0, (90.0, 5.0)) == pytest.approx(passed, abs=0.02)


def of_levels(level, thrust):
    """A run of levels of one second each with their samples (n, 100)."""
    n = level.size
    return replace(
        H,
        edges=np.arange(n + 1.0),
        driver=np.sqrt(level),
        thrust=thrust.mean(axis=1),
        excess=np.zeros(1),
        sample_time=np.repeat(np.arange(n), 100) + np.tile((np.arange(100) + 0.5) / 100, n),
        sample_thrust=thrust.ravel(),
    )


@pytest.mark.parametrize("dof", [4, np.inf])
def test_a_clipping_cell_knows_how_its_samples_scatter_in_the_tails(dof):
    """Levels of 100 samples each; Student's noise of four degrees of freedom, or normal."""
    rng = np.random.default_rng(3)
    level = np.concatenate([rng.uniform(40.0, 80.0, 90), np.linspace(94.0, 106.0, 40)])
    e = rng.standard_normal((level.size, 100)) if np.isinf(dof) else rng.standard_t(dof, (level.size, 100))
    run = of_levels(level, np.clip(level[:, None] + e, -100.0, 100.0))
    std, tails = run.scatter
    assert std == pytest.approx(1.0, rel=0.1)
    assert tails == pytest.approx(0.0 if np.isinf(dof) else 0.12, abs=0.04)
    got = term("load_cell_saturation").apply(
        level, moment(run, replace(S, noise=1.0), x=np.zeros(level.size)), (100.0,)
    )
    many = rng.standard_normal(40_000) if np.isinf(dof) else rng.standard_t(dof, 40_000)
    expected = np.minimum(level[:, None] + many, 100.0).mean(axis=1)
    assert got == pytest.approx(expected, abs=0.03)


def test_noise_that_is_proportional_scatters_most_where_the_cell_clips():
    rng = np.random.default_rng(4)
    level = np.concatenate([rng.uniform(5.0, 85.0, 300), np.linspace(97.0, 103.0, 10)])
    thrust = level[:, None] + np.hypot(0.5, 0.02 * level)[:, None] * rng.standard_normal((level.size, 100))
    std, tails = of_levels(level, np.clip(thrust, -100.0, 100.0)).scatter
    assert std == pytest.approx(np.hypot(0.5, 0.02 * 100.0), rel=0.05)
    assert tails < 0.03


def through_zero():
    """A ramp from -14 V to 14 V, and the command within each interval (30, 4001)."""
    ends = np.linspace(-14.0, 14.0, 31)
    fine = np.linspace(ends[:-1], ends[1:], 4001).T
    mean = fine.mean(axis=1)
    return replace(H, edges=np.arange(31.0), driver=mean, excess=np.mean(fine**2, axis=1) - mean**2), fine


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_ramp_through_the_limit_of_the_cell_clips_in_a_part_of_each_interval(noise):
    ramp, fine = through_zero()
    mean = ramp.driver
    e = noise * np.random.default_rng(2).standard_normal(fine.shape)
    force = 0.5 * fine * np.abs(fine)
    expected = np.clip(force + e, -60.0, 60.0).mean(axis=1)
    at = moment(ramp, replace(S, noise=noise), x=mean)
    got = term("load_cell_saturation").apply(force.mean(axis=1), at, (60.0,))
    assert got == pytest.approx(expected, abs=0.06 + 5 * noise / 60)
    assert np.max(np.abs(np.clip(force.mean(axis=1), -60.0, 60.0) - expected)) > 0.3, "not the clipped mean"
    share = term("load_cell_saturation").shown(ramp, 0.5, mean, got, (60.0,))
    assert share == pytest.approx((np.abs(force) < 60.0).mean(axis=1), abs=0.03 + 0.3 * noise)


def compressed(size, bend, onset):
    """Its slope 1 - bend (size - onset) integrated numerically."""
    fine = np.linspace(0.0, size, 20_001)
    return np.trapezoid(np.clip(1 - bend * np.maximum(fine - onset, 0.0), 0.0, 1.0), fine)


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_ramp_through_the_knee_of_the_cell(noise):
    ramp, fine = through_zero()
    mean = ramp.driver
    force = 0.5 * fine * np.abs(fine) + noise * np.random.default_rng(2).standard_normal(fine.shape)
    bend, onset = 0.02, 40.0
    e = np.clip(np.abs(force) - onset, 0.0, 1 / bend)
    expected = (np.sign(force) * (np.minimum(np.abs(force), onset) + e - 0.5 * bend * e**2)).mean(axis=1)
    knee = term("load_cell_saturation", "knee")
    got = knee.apply(force.mean(axis=1), moment(ramp, replace(S, noise=noise), x=mean), (bend, onset))
    assert got == pytest.approx(expected, abs=0.02 + 0.01 * noise)
    assert knee.shown(ramp, 0.5, mean, np.array([compressed(60.0, bend, onset)]), (bend, onset)) == pytest.approx(0.6)


def test_a_command_in_a_knee_moves_the_rotor_by_the_slope():
    volts = np.array([5.0, 12.0, 16.0, -16.0, 25.0])
    still = replace(H, edges=np.arange(6.0), driver=volts, excess=np.zeros(5))
    knee = term("command_saturation", "knee")
    got = knee.apply(volts, moment(still, S, x=volts), (0.1, 10.0))
    assert got == pytest.approx([np.sign(v) * compressed(abs(v), 0.1, 10.0) for v in volts])
    assert knee.passed(still, (0.1, 10.0)) == pytest.approx([1.0, 0.8, 0.4, 0.4, 0.0])
    assert knee.apply(volts, moment(still, S, x=volts), (0.0, 10.0)) == pytest.approx(volts)


def test_a_jet_on_a_circuit_comes_later():
    dt = np.full(400, 0.5)
    steady = replace(H, edges=np.append(0.0, np.cumsum(dt)), driver=np.full(400, 10.0), excess=np.zeros(400))
    at = moment(steady, S, x=np.full(400, 10.0))
    late, prompt = (
        term("recirculation", kind).apply(np.full(400, 50.0), at, (0.04, 20.0)) for kind in ("circuit", "rate")
    )
    t = steady.edges[1:] - 0.25
    assert late == pytest.approx(50.0 - 4.0 * (1 - (1 + t / 20.0) * np.exp(-t / 20.0)), abs=2e-3)
    assert np.all(late >= prompt - 1e-9)


def test_ringing_that_lasts_is_tried_at_every_frequency():
    """1.07 Hz of 2.7 %: trials of 10 % were best at 7.6 Hz, and the fit ended at 4.6 Hz for a third of the gain."""
    stand = term("stand_resonance")
    most = stand.parameters(S)[1].high
    lasting = np.unique([f for _, f, damping in stand.finer((1.0, 7.56, 0.1), S) if damping < 0.05])
    assert lasting[0] < 0.6
    assert lasting[-1] == pytest.approx(most)
    assert np.max(lasting[1:] / lasting[:-1]) < 1.06
