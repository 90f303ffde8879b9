"""From a recording to its intervals: every sample counted once, steps on edges, and each refusal in its sentence."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.prepare.preparing import Refusal, history_of
from identification.recording import Channel, Recording
from identification.run_history.history import History

UNITS = {
    "thrust": "N",
    "command_voltage": "V",
    "motor_voltage": "V",
    "rotation_rate": "rev/s",
    "bus_voltage": "V",
    "flow_speed": "m/s",
    "motor_temperature": "degC",
    "water_temperature": "degC",
    "current": "A",
}


def channel(quantity, time, value, **known):
    return Channel(
        quantity, quantity, quantity, UNITS[quantity], np.asarray(time, float), np.asarray(value, float), **known
    )


def recording(*channels):
    return Recording("one", "T1", channels, source="run.h5")


LEVELS = np.array([0.0, 6.0, 0.0, -6.0, 12.0, -12.0, 3.0, 0.0])
CHANGES = np.array([0.0, 5.013, 10.008, 15.019, 20.004, 25.011, 30.007, 35.014])


def held(t, times=CHANGES, levels=LEVELS):
    return levels[np.maximum(np.searchsorted(times, t, side="right") - 1, 0)]


def stepped(rate=50.0, seed=1, noise=0.1, **others):
    """40 s of steps, thrust 0.5 V|V| + 2 N sampled at `rate`."""
    t = np.arange(0.003, 40.0, 1 / rate)
    v = held(t)
    thrust = 0.5 * v * np.abs(v) + 2.0 + noise * np.random.default_rng(seed).standard_normal(t.size)
    return recording(channel("command_voltage", CHANGES, LEVELS), channel("thrust", t, thrust), *others.values())


def without_noise(rate=50.0):
    return stepped(rate, noise=0.0)


# ---------------------------------------------------------------- refusals


def refused(*channels):
    found = history_of(recording(*channels))
    assert isinstance(found, Refusal)
    assert found.reason.startswith("run.h5")
    return found.reason


T = np.arange(0, 20, 0.1)
COMMAND = channel("command_voltage", CHANGES, LEVELS)


@pytest.mark.parametrize(
    ("channels", "says"),
    [
        ([COMMAND], "has no thrust channel (quantity thrust): there is no response to explain"),
        ([COMMAND, channel("thrust", [], [])], "has 0 finite thrust samples; at least 5 are needed"),
        ([COMMAND, channel("thrust", T[:9], [1, 2, 3, 4] + [np.nan] * 5)], "has 4 finite thrust samples"),
        (
            [channel("thrust", T, T)],
            "has none of command_voltage, motor_voltage, rotation_rate: nothing tells what drove the thruster",
        ),
        (
            [channel("thrust", T, T), channel("command_voltage", T, 0 * T + 6)],
            "cannot be diagnosed: command_voltage is 6 throughout; at least two levels are needed",
        ),
        (
            [channel("thrust", T, T), channel("command_voltage", T, np.nan * T), channel("motor_voltage", T, 0 * T)],
            "command_voltage holds no number, motor_voltage is 0 throughout",
        ),
        (
            [channel("thrust", T, T), channel("rotation_rate", 500 + T, T)],
            "thrust and rotation_rate share no stretch of time; are both on one clock?",
        ),
        (
            [channel("thrust", T, T), channel("command_voltage", 500 + T, T)],
            "thrust and command_voltage share no stretch of time",
        ),
    ],
)
def test_each_refusal_says_who_and_what(channels, says):
    assert says in refused(*channels)


def test_samples_at_steps_only_are_refused():
    at = np.arange(1.0, 6.0) * 5
    thrust = channel("thrust", np.concatenate([at, [25.002]]), np.arange(6.0))
    command = channel("command_voltage", at, [1.0, -1.0, 1.0, -1.0, 1.0])
    found = history_of(recording(thrust, command))
    # few samples a step: kept, a table of levels may be so; the clocks are asked only where there are many
    assert not isinstance(found, Refusal)


def test_a_recording_without_a_source_is_named_by_its_id():
    found = history_of(replace(recording(COMMAND), source=""))
    assert isinstance(found, Refusal)
    assert found.reason.startswith("one ")


# ---------------------------------------------------------------- which channel drives


def test_the_best_channel_that_moves_drives():
    t = np.arange(0, 40, 0.02)
    still = channel("command_voltage", CHANGES, 0 * CHANGES)
    motor, rate = channel("motor_voltage", t, held(t)), channel("rotation_rate", t, 2 * held(t))
    thrust = channel("thrust", t + 0.003, held(t))
    assert history_of(recording(COMMAND, motor, rate, thrust)).driver_quantity == "command_voltage"
    assert history_of(recording(still, motor, rate, thrust)).driver_quantity == "motor_voltage"
    by_rate = history_of(recording(still, rate, thrust))
    assert by_rate.driver_quantity == "rotation_rate"
    assert by_rate.rate is None  # what drives is no response
    assert "rotation_rate" not in by_rate.others


# ---------------------------------------------------------------- intervals


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


# ---------------------------------------------------------------- clocks that are not perfect


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


# ---------------------------------------------------------------- tables


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


# ---------------------------------------------------------------- what else was recorded


def test_the_rate_is_a_second_response():
    t = np.arange(0.004, 40, 0.05)
    h = history_of(with_others(channel("rotation_rate", t, 2 * held(t))))
    assert h.rate is not None
    assert h.rate_count.sum() == t.size
    assert h.rate_per_driver == pytest.approx(2.0, rel=0.02)
    assert h.rate_spacing == pytest.approx(0.05)
    assert np.all(np.isfinite(h.rate[h.rate_rows]))


def with_others(*channels):
    r = stepped()
    return replace(r, channels=(*r.channels, *channels))


def test_a_noisy_slow_channel_is_calmed_but_its_jumps_stay():
    t = np.arange(0, 40, 0.5)
    rng = np.random.default_rng(3)
    flow = np.where(t < 20.2, 0.0, 0.8)
    h = history_of(with_others(channel("flow_speed", t, flow + 0.01 * rng.standard_normal(t.size))))
    seen = h.others["flow_speed"]
    far = np.abs(h.middle - 20.25) > 0.5
    assert seen[far] == pytest.approx(np.where(h.middle < 20.25, 0.0, 0.8)[far], abs=0.03)
    assert np.std(seen[h.middle < 17]) < 0.006


def test_a_slow_wave_of_a_quiet_channel_is_not_flattened():
    t = np.arange(0, 40, 1.0)
    wave = 15 + 4 * np.sin(t / 9)
    h = history_of(with_others(channel("water_temperature", t, wave)))
    inside = (h.middle > 2) & (h.middle < 36)
    assert h.others["water_temperature"][inside] == pytest.approx(15 + 4 * np.sin(h.middle[inside] / 9), abs=0.03)


def test_the_direction_of_change_is_known_on_a_slow_sine_and_on_levels():
    volts = 12 * np.sin(np.arange(0, 200) / 20)
    none = np.zeros(200)
    h = History("sine", "command_voltage", 0.1 * np.arange(201.0), volts, volts, np.ones(200, int), none, none)
    rising = np.cos(np.arange(0, 200) / 20)
    clear = np.abs(rising) > 0.2
    assert (h.direction_of_change == np.sign(rising))[clear].mean() > 0.99
    held = replace(h, driver=np.repeat([0.0, 4.0, 8.0, 2.0], 50))
    assert held.direction_of_change[[10, 60, 110, 160]].tolist() == [0.0, 1.0, 1.0, -1.0]


def test_thrust_between_two_samples_of_a_jumping_flow_is_not_judged():
    t = np.arange(0, 40, 1.0)
    flow = np.where((t > 12) & (t < 33), 0.8, 0.0)
    h = history_of(with_others(channel("flow_speed", t, flow)))
    near = ((h.sampled > 12) & (h.sampled < 13)) | ((h.sampled > 32) & (h.sampled < 33))
    assert not h.count[near].any()
    assert h.count[~near].sum() > 0.9 * 2000


def test_a_supply_that_follows_the_load_is_known_between_its_samples():
    t = np.arange(0.1, 40, 0.5)
    bus = 30 - 0.02 * np.abs(held(t)) ** 3 / 12
    h = history_of(with_others(channel("bus_voltage", t, bus)))
    exact = 30 - 0.02 * np.abs(h.driver) ** 3 / 12
    assert h.others["bus_voltage"] == pytest.approx(exact, abs=0.02)
    few = history_of(with_others(channel("bus_voltage", [0.0, 20.0, 40.0], [30.0, 29.0, 28.0])))
    assert few.others["bus_voltage"] == pytest.approx(30 - 0.05 * few.middle)


def test_the_noise_of_a_supply_is_averaged_but_not_across_a_change_of_the_load():
    """A battery that recovers slowly after each change: neither the load alone nor a long mean tells it."""
    t = np.arange(0.1, 40, 0.05)
    noise = 0.05 * np.random.default_rng(4).standard_normal(t.size)

    def error(bus):
        h = history_of(with_others(channel("bus_voltage", t, bus(t) + noise)))
        return float(np.sqrt(np.average((h.others["bus_voltage"] - bus(h.middle)) ** 2, weights=h.dt)))

    by_load = error(lambda s: 30 - 0.02 * np.abs(held(s)) ** 3 / 12)
    assert by_load < 0.01, "a fifth of the noise of a sample"
    falls = error(lambda s: 30 - 0.02 * np.abs(held(s)) ** 3 / 12 - 0.01 * s + 0.2 * np.sin(s / 4))
    assert falls < 0.025


def test_channels_with_less_than_two_numbers_are_not_there():
    h = history_of(with_others(channel("current", [1.0, 2.0], [np.nan, 3.0]), channel("motor_temperature", [], [])))
    assert "current" not in h.others
    assert "motor_temperature" not in h.others


def test_a_neighbour_is_seen_by_its_thrust_or_its_command():
    t = np.arange(0, 40, 0.1)
    thrust = channel("thrust", t, 5 + 0 * t, thruster="T2")
    command = channel("command_voltage", [4.0, 20.0], [6.0, -3.0], thruster="T2")
    assert history_of(with_others(thrust)).others["neighbour_thrust"] == pytest.approx(5.0)
    seen = history_of(with_others(command))
    assert seen.driver_quantity == "command_voltage"
    m = seen.middle
    clear = (np.abs(m - 4) > 0.3) & (np.abs(m - 20) > 0.3)
    expected = np.where(m < 4, 0.0, np.where(m < 20, 36.0, -9.0))
    assert seen.others["neighbour_thrust"][clear] == pytest.approx(expected[clear])


def test_the_thruster_on_the_bench_is_the_one_that_is_diagnosed():
    """Whichever of the two was written first."""
    t = np.arange(0, 40, 0.1)
    other = (
        channel("thrust", t, 5 + 0 * t, thruster="T2"),
        channel("command_voltage", [4.0, 20.0], [6.0, -3.0], thruster="T2"),
    )
    r = stepped()
    first, last = replace(r, channels=(*other, *r.channels)), replace(r, channels=(*r.channels, *other))
    one, two = history_of(first), history_of(last)
    for got, wanted in ((one.thrust[one.rows], two.thrust[two.rows]), (one.driver, two.driver)):
        assert np.array_equal(got, wanted)
    assert one.others["neighbour_thrust"] == pytest.approx(5.0)
