"""How late thrust is after a step, by areas: of a lag its time constant, of a delay itself."""

import numpy as np
import pytest

from identification.recording import Channel, Recording, Step
from identification.thruster.settling import settling_time

RATE, DWELL = 100.0, 2.0
LEVELS = (0.0, 10.0, -10.0, 6.0, -8.0, 0.0)
C = 0.4


def recording(answer, noise=0.0, levels=LEVELS, gap=0.0):
    """`answer`: from time since a step (s) to the share of it that is there."""
    time = np.arange(0.0, len(levels) * DWELL, 1.0 / RATE)
    since, at = time % DWELL, (time // DWELL).astype(int)
    force = C * np.array(levels) * np.abs(levels)
    before = np.concatenate(([0.0], force))[at]
    thrust = before + (force[at] - before) * answer(since)
    thrust = thrust + noise * np.random.default_rng(5).standard_normal(time.size)
    steps = tuple(Step(k, "hold", V, k * DWELL, (k + 1) * DWELL - gap) for k, V in enumerate(levels))
    none = np.empty(0)
    channel = Channel("thrust", "cell", "thrust", "N", time, thrust)
    command = Channel("command_voltage", "command", "command_voltage", "V", none, none)
    return Recording("r", "T", channels=(channel, command), steps=steps)


@pytest.mark.parametrize("lag", [0.05, 0.2])
def test_a_lag_is_its_time_constant(lag):
    found = settling_time(recording(lambda t: 1.0 - np.exp(-t / lag)))
    assert found.value == pytest.approx(lag, rel=0.02, abs=0.5 / RATE)
    assert found.steps == 5


def test_a_delay_is_itself_and_nothing_late_is_zero():
    assert settling_time(recording(lambda t: t >= 0.105)).value == pytest.approx(0.105, abs=0.5 / RATE)
    assert settling_time(recording(lambda t: t >= 0.0)).value == pytest.approx(0.0, abs=0.5 / RATE)


def test_its_standard_error_is_that_of_many_runs():
    rng = np.random.default_rng(1)
    found = []
    for _ in range(200):
        plain = recording(lambda t: 1.0 - np.exp(-t / 0.1))
        thrust = plain.channels[0]
        noisy = Channel(
            "thrust", "cell", "thrust", "N", thrust.time, thrust.value + rng.normal(0.0, 1.0, thrust.time.size)
        )
        found.append(settling_time(Recording("r", "T", channels=(noisy, plain.channels[1]), steps=plain.steps)))
    stated = float(np.mean([each.std for each in found]))
    assert stated == pytest.approx(float(np.std([each.value for each in found])), rel=0.3)


def test_without_two_levels_beside_each_other_there_is_none():
    assert settling_time(recording(lambda t: t >= 0.0, levels=(5.0,))) is None
    assert settling_time(recording(lambda t: t >= 0.0, gap=0.5)) is None
    assert settling_time(Recording("r", "T", channels=(), steps=())) is None
