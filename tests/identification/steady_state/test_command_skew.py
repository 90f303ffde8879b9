"""A thrust that leads or lags its command by a part of a level is told with the number; one in its place is not."""

import numpy as np
import pytest

from identification.recording import Channel, Recording
from identification.steady_state.command_skew import command_skew

LEVELS = np.array([0.0, 4.0, 8.0, 12.0, 6.0, -4.0, -9.0, 0.0])
LEVEL = 5.0


def recording(command_time, volts, time, thrust):
    command = Channel("u", "command", "command_voltage", "V", np.asarray(command_time), np.asarray(volts))
    return Recording("id", "T1", (command, Channel("f", "cell", "thrust", "N", np.asarray(time), np.asarray(thrust))))


def table(place):
    """One sample per level, at `place` of it."""
    begins = np.arange(LEVELS.size) * LEVEL
    return recording(begins, LEVELS, begins + place * LEVEL, 0.4 * LEVELS * np.abs(LEVELS))


def log(shift, seed=0, lag=0.1):
    """Dense samples of a thrust that comes `shift` s late, with a motor's lag (s)."""
    t = np.arange(0, LEVELS.size * LEVEL, 0.02)
    wanted = LEVELS[np.clip(((t - shift) // LEVEL).astype(int), 0, LEVELS.size - 1)]
    thrust, now = np.empty_like(t), 0.0
    for k, V in enumerate(wanted):
        now += (0.4 * V * abs(V) - now) * 0.02 / lag
        thrust[k] = now
    noise = np.random.default_rng(seed).normal(0, 0.3, t.size)
    return recording(np.arange(LEVELS.size) * LEVEL, LEVELS, t, thrust + noise)


@pytest.mark.parametrize(("place", "seconds"), [(0.0, -2.5), (0.98, 2.4)])
def test_a_table_whose_means_stand_at_an_edge_of_their_level_is_told(place, seconds):
    found = command_skew(table(place))
    assert found is not None
    assert found.seconds == pytest.approx(seconds)
    assert f"{abs(seconds):.3g} s, {100 * abs(seconds) / LEVEL:.0f} % of a level" in found.statement
    assert "[time] levels = true" in found.statement


def test_a_level_measured_three_times_begins_half_a_row_late():
    begins = np.arange(LEVELS.size) * 3 * LEVEL
    time = np.arange(3 * LEVELS.size) * LEVEL
    thrust = np.repeat(0.4 * LEVELS * np.abs(LEVELS), 3)
    found = command_skew(recording(begins, LEVELS, time, thrust))
    assert found is not None
    assert (found.seconds, found.level) == pytest.approx((-0.5 * LEVEL, 3 * LEVEL))
    assert command_skew(recording(begins, LEVELS, time + 0.5 * LEVEL, thrust)) is None


def test_a_table_whose_means_stand_in_the_middle_is_right():
    assert command_skew(table(0.5)) is None


@pytest.mark.parametrize("shift", [-2.0, -1.0, 1.0, 2.0])
def test_a_log_with_shifted_clocks_is_told_by_how_much(shift):
    found = command_skew(log(shift))
    assert found is not None
    assert abs(found.seconds - shift) < 0.25
    assert ("lags" if shift > 0 else "leads") in found.statement
    assert "--offset" in found.statement


@pytest.mark.parametrize("lag", [0.05, 0.3])
def test_a_motor_that_settles_within_its_level_is_no_shift(lag):
    assert [command_skew(log(0.0, seed, lag)) for seed in range(5)] == [None] * 5


def test_without_command_or_with_one_level_there_is_nothing_to_say():
    t = np.arange(0.0, 20.0, 0.1)
    assert command_skew(recording([0.0], [5.0], t, np.ones_like(t))) is None
    only = Recording("id", "T1", (Channel("f", "cell", "thrust", "N", t, t),))
    assert command_skew(only) is None
