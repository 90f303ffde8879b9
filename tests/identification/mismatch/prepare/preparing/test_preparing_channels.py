"""What else was recorded: a second response, calmed channels, neighbours, the thruster on the bench."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.prepare.preparing import history_of
from identification.run_history.history import History
from tests.identification.mismatch.prepare.preparing.stepped_recordings import channel, held, stepped


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
