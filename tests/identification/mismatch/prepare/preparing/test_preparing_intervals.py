"""From a recording to its intervals: every sample counted once, steps on edges, clocks that are not perfect."""

import numpy as np
import pytest

from identification.mismatch.prepare.preparing import history_of
from tests.identification.mismatch.prepare.preparing.stepped_recordings import (
    CHANGES,
    COMMAND,
    channel,
    held,
    recording,
    stepped,
)


def without_noise(rate=50.0):
    return stepped(rate, noise=0.0)


@pytest.mark.parametrize("rate", [8.0, 50.0, 97.3, 400.0])
def test_every_sample_clear_of_a_step_is_in_one_interval(rate):
    r = stepped(rate)
    h = history_of(r)
    t, f = r.channels[1].time, r.channels[1].value
    before, after = min(0.002, 0.1 / rate), min(0.003, 0.1 / rate)
    late = t - CHANGES[np.maximum(np.searchsorted(CHANGES, t + before, side="right") - 1, 0)]
    clear = (late > after) | (t < CHANGES[1] - before)  # the first row, 0 V, is no step
    if t.size >= 4 * CHANGES.size:
        t, f = t[clear], f[clear]
    assert h.count.sum() == t.size
    assert np.all(np.diff(h.edges) > 0)
    i = np.searchsorted(h.edges, t, side="right") - 1
    for k in np.unique(i)[:: max(i.size // 300, 1)]:
        assert h.count[k] == np.sum(i == k)
        assert h.thrust[k] == pytest.approx(f[i == k].mean())
        assert h.sampled[k] == pytest.approx(t[i == k].mean())
        assert h.within[k] == pytest.approx(np.sum((f[i == k] - f[i == k].mean()) ** 2))
    assert np.all(np.isnan(h.thrust[h.count == 0]))
    assert h.spacing == pytest.approx(1 / rate, rel=0.01)


@pytest.mark.parametrize("rate", [50.0, 400.0])
def test_steps_are_edges_and_levels_do_not_mix(rate):
    h = history_of(without_noise(rate))
    for at in CHANGES[1:]:
        assert np.min(np.abs(h.edges - at)) < 1e-9
    v = held(h.middle)
    assert h.driver == pytest.approx(v)
    rows = h.rows
    assert h.thrust[rows] == pytest.approx(0.5 * v[rows] * np.abs(v[rows]) + 2.0)


def test_intervals_are_short_after_a_step_and_grow():
    h = history_of(stepped(200.0))
    since = h.middle - CHANGES[np.searchsorted(CHANGES, h.middle, side="right") - 1]
    inner = h.middle > 5.1
    assert h.dt[inner & (since < 0.03)].max() <= 0.0126
    assert np.median(h.dt[inner & (since > 4.0)]) > 0.1
    assert h.dt.max() < 0.5
    assert h.edges.size < 0.4 * 40 * 200


def test_slow_samples_shortly_after_a_step_have_windows_of_their_own():
    h = history_of(stepped(10.0))
    first = np.array([h.dt[np.searchsorted(h.edges, t, side="right") - 1] for t in np.arange(5.103, 5.5, 0.1)])
    assert first.max() <= 0.0031
    late = h.dt[np.searchsorted(h.edges, 9.503, side="right") - 1]
    assert late > 0.05


def test_no_more_intervals_than_asked_for():
    long = history_of(stepped(400.0), most_intervals=150)
    full = history_of(stepped(400.0))
    assert long.edges.size < 300 < 500 < full.edges.size  # about 20 a step come on top
    assert long.count.sum() == full.count.sum()


def test_since_step_and_previous_level():
    h = history_of(without_noise())
    at = np.searchsorted(h.edges, 22.0) - 1
    assert h.driver[at] == 12.0
    assert h.previous[at] == -6.0
    assert h.since_step[at] == pytest.approx(h.middle[at] - 20.004)
    assert h.previous[0] == 0.0
    assert h.size == 12.0
    assert not h.static


def test_missing_samples_are_left_out():
    r = stepped()
    value = r.channels[1].value.copy()
    value[500:600] = np.nan
    h = history_of(recording(COMMAND, channel("thrust", r.channels[1].time, value)))
    whole = history_of(r)
    assert whole.count.sum() - h.count.sum() == pytest.approx(100, abs=2)
    assert np.all(np.isfinite(h.thrust[h.rows]))


def test_samples_of_one_time_are_one_sample():
    r = stepped()
    time, value = r.channels[1].time, r.channels[1].value
    twice = channel("thrust", np.repeat(time, 2), np.repeat(value, 2) + np.tile([1.0, -1.0], time.size))
    h, once = history_of(recording(COMMAND, twice)), history_of(r)
    assert h.thrust[h.rows] == pytest.approx(once.thrust[once.rows])
    assert h.count.sum() == once.count.sum()


def test_irregular_sampling_with_a_gap():
    rng = np.random.default_rng(2)
    t = np.sort(rng.uniform(0, 40, 1500))
    t = t[(t < 26) | (t > 29)]
    v = held(t)
    h = history_of(recording(COMMAND, channel("thrust", t, 0.5 * v * np.abs(v))))
    x = h.driver[h.rows]
    assert h.thrust[h.rows] == pytest.approx(0.5 * x * np.abs(x))
    assert np.all(np.diff(h.edges) > 0)


def test_samples_outside_a_measured_driver_are_left_out():
    t = np.arange(0, 40, 0.02)
    inside = (t > 10) & (t < 30)
    h = history_of(recording(channel("motor_voltage", t[inside], held(t)[inside]), channel("thrust", t, held(t))))
    assert h.edges[0] >= 9.9
    assert h.edges[-1] <= 30.1


def test_a_measured_driver_is_a_straight_line_between_its_samples():
    t = np.arange(0, 40, 0.5)
    ramp = np.where(t < 20, t, 40 - t)
    s = np.arange(0.01, 39.4, 0.02)
    exact = np.where(s < 20, s, 40 - s)
    h = history_of(recording(channel("motor_voltage", t, ramp), channel("thrust", s, exact)))
    assert h.driver == pytest.approx(np.interp(h.middle, t, ramp), abs=0.01)
    assert h.thrust[h.rows] == pytest.approx(h.driver[h.rows], abs=0.05)


def test_a_table_of_levels_is_static():
    start = 4.0 * np.arange(20)
    volts = np.linspace(-12, 12, 20)
    h = history_of(
        recording(channel("command_voltage", start, volts), channel("thrust", start + 2, 0.5 * volts * np.abs(volts)))
    )
    assert h.static
    assert h.rows.size == 20
    assert h.driver[h.rows] == pytest.approx(volts)
    assert h.thrust[h.rows] == pytest.approx(0.5 * volts * np.abs(volts))


def test_a_ramp_is_no_table_however_few_its_samples():
    """Dynamics and drifts of ramps and sines went unseen when their commands counted as levels."""
    t = np.arange(0, 60, 0.02)
    command = channel("command_voltage", t, 12 * np.sin(0.3 * t))
    h = history_of(recording(command, channel("thrust", t[::2] + 0.001, np.sin(t[::2]))))
    assert not h.static
