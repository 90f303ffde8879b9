"""Orders of the rotor: found in stretches of steady turning, with amplitude and phase; none where there is none."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from identification.estimation.tails import gamma_median
from identification.mismatch import policy
from identification.mismatch.periodic.line_or_order import as_turning
from identification.mismatch.periodic.order_law import FORCE
from identification.mismatch.periodic.order_search import LARGEST_SHAPE, OrderCandidate, candidates, standing
from identification.mismatch.periodic.order_tracking import find_locked
from identification.mismatch.periodic.periodic_disturbances import find_lines
from identification.mismatch.periodic.rotor_angle import Part, turned, wave_of
from identification.mismatch.periodic.spectrum import Series
from identification.mismatch.periodic.steady_segments import Colour, quick, speed_of, stretches
from identification.mismatch.periodic.whole_orders import whole_orders
from identification.run_history.converter import Converter
from tests.identification.mismatch.small import rng

RATE, LENGTH = 60.0, 100.0
ALARM = policy.periodic.LINE_FALSE_ALARM
NONE = OrderCandidate(1.0, 1.0, 1.0)


def clearest(parts, top):
    return min(candidates(parts, top), key=lambda each: each.p_value)


def turning(seed=0, wave=0.0, order=3.0, phase=0.7, noise=1.0, speeds=None, slips=False):
    """A rotor at random levels, noise on the thrust, and a wave of so many periods a turn."""
    draw = rng(seed)
    t = np.arange(int(LENGTH * RATE)) / RATE
    edges = np.concatenate([[0.0], np.cumsum(draw.uniform(2, 6, 60))])
    speed = draw.uniform(3, 14, 60) * np.where(draw.random(60) < 0.2, 0.0, 1.0) if speeds is None else speeds
    turns = turned(edges, speed, t)
    level = np.searchsorted(edges, t, side="right") - 1
    late = draw.uniform(0, 2 * np.pi, 60)[level] if slips else 0.0
    moving = speed[level] > 0
    value = noise * draw.standard_normal(t.size) + wave * np.sin(2 * np.pi * order * turns + phase + late) * moving
    return Series(t, value, turns)


def parts_of(series):
    top = float(np.quantile(speed_of(series), 0.99))
    return list(stretches([(0, series)], top)), top


# ---------------------------------------------------------------- stretches


def test_stretches_are_steady_and_hold_all_that_turns():
    series = turning()
    parts, top = parts_of(series)
    speed = speed_of(series)
    inside = np.zeros(series.time.size, dtype=bool)
    for p in parts:
        where = (series.time >= p.time[0]) & (series.time <= p.time[-1])
        assert not np.any(inside & where), "none twice"
        inside |= where
        assert np.ptp(speed[where]) < 0.35 * top
        assert p.time[-1] - p.time[0] <= 8.1
        assert p.speed == pytest.approx(np.mean(speed[where]), rel=0.1)
    assert np.mean(inside[speed > 0.2 * top]) > 0.8
    assert not np.any(inside[speed < 0.02 * top])


def test_whitened_stretches_have_variance_one_whatever_the_colour():
    series = turning(seed=2)
    e = series.residual
    coloured = Series(series.time, np.convolve(e, [1.0, 0.9, 0.6])[: e.size], series.turns)
    white = Colour(coloured, np.zeros(e.size)).whitened()
    assert np.std(white) == pytest.approx(1.0, abs=0.1)
    assert abs(np.mean(white[1:] * white[:-1])) < 0.12
    slow = Series(series.time, 50 * np.sin(series.time / 10), series.turns)
    assert np.std(quick(slow, slow.residual)[200:-200]) < 0.1, "what is slow is taken off"


def test_the_power_of_a_stretch_is_seen_over_its_own_noise():
    """A slope of the spectrum of three decades: over it one everywhere; aliases folded back."""
    series = turning(seed=4)
    e = series.residual
    red = np.convolve(e, 0.9 ** np.arange(60))[: e.size]
    colour = Colour(Series(series.time, red, series.turns), np.zeros(e.size))
    z = np.linspace(0.5, 4.0, 200)
    speed = np.array([8.0])
    seen = np.abs(z * 8.0 - RATE * np.round(z * 8.0 / RATE))
    shape = 1 / np.abs(1 - 0.9 * np.exp(-2j * np.pi * seen / RATE)) ** 2
    found = colour.out_of(shape, z, speed)
    usual = seen > 3.0
    assert np.std(np.log(found[usual])) < 0.4 < 0.5 * np.std(np.log(shape[usual]))
    assert colour.variance(2.0, speed) == pytest.approx(
        1 / abs(1 - 0.9 * np.exp(-2j * np.pi * 16 / RATE)) ** 2, rel=0.4
    )


def test_a_trend_is_up_down_or_none():
    t = np.arange(0.0, 5.0, 0.02)
    for slope, trend in ((0.0, 0), (1.0, 1), (-1.0, 2)):
        turns = 8 * t + 0.5 * slope * t**2
        (p, *_) = stretches([(0, Series(t, rng(1).standard_normal(t.size), turns))], 10.0)
        assert p.trend(0.05) == trend


# ---------------------------------------------------------------- the search


@pytest.mark.parametrize("order", [3.0, 4.37])
def test_an_order_stands_out_where_it_is(order):
    parts, top = parts_of(turning(seed=1, wave=0.5, order=order))
    found = clearest(parts, top)
    assert found.ratio == pytest.approx(order, abs=max(found.reach, 0.01))
    assert found.p_value < 1e-6


def test_an_order_whose_phase_slips_stands_out_by_its_power():
    parts, top = parts_of(turning(seed=3, wave=0.8, slips=True))
    found = clearest(parts, top)
    assert found.ratio == pytest.approx(3.0, abs=0.05)
    assert found.p_value < 1e-3


def test_of_noise_p_values_are_no_smaller_than_they_should_be():
    """Twenty rotors with nothing on them: of a p-value below a tenth two are expected."""
    found = [clearest(*parts_of(turning(seed=seed))).p_value for seed in range(20)]
    assert sum(p < 0.1 for p in found) <= 5
    assert min(found) > 1e-3


# ---------------------------------------------------------------- tracking


def test_amplitude_ratio_and_phase_are_within_their_errors():
    """Seven rotors; all three by their standard errors."""
    off = []
    for seed in range(7):
        found = find_locked([(0, turning(seed=seed, wave=0.5))], ALARM)
        assert found is not None
        assert found.phase is not None
        off.append((found.amplitude - 0.5) / found.amplitude_std)
        off.append((found.ratio - 3.0) / found.ratio_std)
        off.append((np.angle(np.exp(1j * (found.phase - 0.7)))) / found.phase_std)
    assert np.sqrt(np.mean(np.square(off))) < 1.6
    assert np.max(np.abs(off)) < 4.0


def test_what_was_found_is_the_wave_that_was_there():
    series = turning(seed=1, wave=0.5)
    found = find_locked([(0, series)], ALARM)
    made = wave_of(found.parts, 0, series.time, 2 * np.pi * found.ratio * series.turns)
    moving = speed_of(series) > 3.0
    true = 0.5 * np.sin(2 * np.pi * 3.0 * series.turns + 0.7)
    assert np.std((made - true)[moving & (made != 0)]) < 0.1
    assert np.all(made[speed_of(series) < 0.1][1:-1] == 0.0)
    assert found.speed == pytest.approx(np.mean(speed_of(series)[moving]), rel=0.15)


def meaned(speed, blades, size, window, noise, seed):
    """A force of the rotor of so many a turn, by means over a window as long as the time between two readings; `speed`
    (n,) turns per s, every half millisecond."""
    fine = 0.0005 * np.arange(speed.size)
    turns = np.cumsum(speed) * 0.0005
    wave = size * (speed / speed.max()) ** 2 * np.sin(2 * np.pi * blades * turns + 0.7)
    whole = np.cumsum(wave) * 0.0005
    t = np.arange(1.0, fine[-1] - 1.0, window)
    mean = (np.interp(t + 0.5 * window, fine, whole) - np.interp(t - 0.5 * window, fine, whole)) / window
    residual = mean + noise * rng(seed).standard_normal(t.size)
    return Series(t, residual, np.interp(t, fine, turns), Converter(window=window))


def test_a_mean_over_time_turns_the_sign_of_a_wave_that_becomes_shorter_than_it():
    """A sine of up to 12 turns/s read by means over 50 ms: three a turn are beyond one period of the window above 6.7
    turns/s, within one stretch of steady turning and the next."""
    speed = 12.0 * np.abs(np.sin(2 * np.pi * np.arange(0.0, 200.0, 0.0005) / 60.0))
    series = meaned(speed, 3, 2.5, 0.05, 0.17, seed=2)
    lines = find_lines([series])
    assert [line.kind for line in lines] == ["rotation"]
    assert lines[0].ratio == pytest.approx(3.0, abs=4 * lines[0].ratio_std)
    assert lines[0].amplitude == pytest.approx(2.5, abs=4 * lines[0].amplitude_std)
    left = series.residual - lines[0].at(series.time, series.turns)
    assert np.std(left) == pytest.approx(0.17, rel=0.03)


def test_a_whole_order_is_looked_for_as_its_own_samples_show_it():
    """Five a turn at levels of up to 34 turns/s, by means over 13 ms: of one sign and the other, about in turns."""
    speed = np.repeat(np.abs(rng(3).uniform(-34.0, 34.0, 40)), 2000)
    found = find_locked([(0, meaned(speed, 5, 0.9, 0.013, 0.12, seed=4))], ALARM)
    assert found is not None
    assert found.ratio == pytest.approx(5.0, abs=4 * found.ratio_std)
    assert found.amplitude == pytest.approx(0.9, abs=4 * found.amplitude_std)


def test_means_of_noise_have_no_whole_order():
    smallest = []
    for seed in range(40):
        series = replace(turning(seed=seed), converter=Converter(window=1 / RATE))
        parts, top = parts_of(series)
        smallest.append(min(each.p_value for each in [*whole_orders(partial(FORCE.on, parts, top=top), top), NONE]))
    assert np.mean(np.array(smallest) < 0.1) < 0.25
    assert min(smallest) > ALARM / 10


def test_a_phase_that_slips_is_not_told_and_its_size_is():
    found = find_locked([(0, turning(seed=3, wave=1.0, slips=True))], ALARM)
    assert found.phase is None
    assert found.amplitude == pytest.approx(1.0, abs=4 * found.amplitude_std)


def test_nothing_is_found_in_noise_at_rest_or_at_too_few_stretches():
    assert all(find_locked([(0, turning(seed=seed))], ALARM) is None for seed in range(5))
    still = turning(seed=1, speeds=np.zeros(60))
    assert find_locked([(0, still)], ALARM) is None
    t = np.arange(0.0, 4.0, 1 / RATE)
    assert find_locked([(0, Series(t, np.sin(30 * t), 5 * t))], ALARM) is None


def test_a_part_acts_within_its_time_and_run_only():
    t = np.linspace(0, 10, 101)
    made = wave_of([Part(0, 2.0, 4.0, 1.0, 0.0), Part(1, 0.0, 9.0, 5.0, 5.0)], 0, t, np.zeros(t.size))
    assert made.tolist() == np.where((t >= 2.0) & (t < 4.0), 1.0, 0.0).tolist()


# ---------------------------------------------------------------- at one speed


def test_at_one_speed_a_fixed_line_may_be_one_that_goes_with_the_rotor():
    """Always 8 turns a second: 24 Hz is three a turn as well; the gain is that of least squares."""
    series = turning(seed=5, wave=0.5, speeds=np.full(60, 8.0))
    found = as_turning([(0, series)], 24.0, float(np.sqrt(2 / series.time.size)), 1e-9)
    assert found.ratio == pytest.approx(3.0, abs=4 * found.ratio_std)
    assert found.amplitude == pytest.approx(0.5, abs=4 * found.amplitude_std)
    assert found.speed == pytest.approx(8.0)
    angle = 2 * np.pi * found.ratio * series.turns
    X = np.column_stack([np.cos(angle), np.sin(angle)])
    fall = series.residual @ X @ np.linalg.solve(X.T @ X, X.T @ series.residual)
    assert found.gain == pytest.approx(fall, rel=0.03)


def test_what_stands_still_turns_no_line():
    still = turning(speeds=np.zeros(60))
    assert as_turning([(0, still)], 10.0, 0.1, 1e-9) is None


def test_powers_without_spread_are_a_variate_of_the_largest_shape():
    """Alike in whole blocks, as of a residual that is quiet but for one stretch: no overflow."""
    out, shape = standing(np.full(200, 3.0))
    assert shape == pytest.approx(LARGEST_SHAPE)
    np.testing.assert_allclose(out, gamma_median(shape))
