"""While nobody knows what was commanded, as where a watchdog is proved, neither thrust nor rate is read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch import diagnose
from identification.mismatch.policy import prepare
from identification.mismatch.prepare.preparing import history_of
from identification.recording import Channel
from tests.identification.diagnosed_runs import C, run

UNKNOWN = (20.0, 22.0)
"""s: the motor holds what was commanded last until its watchdog ends that, then coasts; 0 V is commanded next."""
RATE_NOISE = 0.002
"""rev/s"""


def proved():
    """A rotor in water, pulled by its motor too, its command unknown for two seconds; its measured rate."""
    bare = run(seconds=120.0, rate=20.0, seed=3)
    command = bare.first_of("command_voltage")
    start, level = command.time, command.value
    t = np.arange(0.0, 120.0, 0.002)
    drive = level[np.maximum(np.searchsorted(start, t, side="right") - 1, 0)]
    drive = np.where((t >= UNKNOWN[0]) & (t < UNKNOWN[0] + 0.5), 9.0, drive)
    drive = np.where((t >= UNKNOWN[0] + 0.5) & (t < UNKNOWN[1] + 4.0), 0.0, drive)
    x = np.zeros(t.size)
    for i in range(1, t.size):
        water = drive[i - 1] * abs(drive[i - 1]) - x[i - 1] * abs(x[i - 1])
        x[i] = x[i - 1] + 0.002 * (0.25 * water + 3.0 * (drive[i - 1] - x[i - 1]))
    rng = np.random.default_rng(4)
    at = np.arange(0.0, 119.9, 0.05)
    n = np.interp(at, t, x) + RATE_NOISE * rng.standard_normal(at.size)
    thrust = bare.first_of("thrust")
    F = C * np.interp(thrust.time, t, x * np.abs(x)) + 0.05 * rng.standard_normal(thrust.time.size)
    rest = UNKNOWN[1] + 4.0
    keep = (start < UNKNOWN[0]) | (start > rest)
    then = level[np.searchsorted(start, rest, side="right") - 1]
    times = np.concatenate([start[keep], [*UNKNOWN, rest]])
    values = np.concatenate([level[keep], [np.nan, 0.0, then]])
    order = np.argsort(times)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", times[order], values[order]),
        replace(thrust, value=F),
        Channel("rotation_rate", "motor", "rotation_rate", "rev/s", at, n),
    )
    return replace(bare, channels=channels)


@pytest.fixture(scope="module")
def recording():
    return proved()


def test_no_row_of_rate_or_thrust_is_of_that_time(recording):
    found = history_of(recording)
    end = UNKNOWN[1] + prepare.AFTER_UNKNOWN_COMMAND
    for times in (found.sample_time, found.rate_time):
        assert not np.any((times >= UNKNOWN[0]) & (times <= end))
        assert np.any(times < UNKNOWN[0])
        assert np.any(times > end)


def test_the_rotor_is_told_by_its_lag_and_by_nothing_beside(recording):
    found = diagnose([recording])
    assert [f.effect for f in found.findings] == ["motor_lag"]
    assert found.twin.rate_per_driver == pytest.approx(1.0, rel=1e-3)
    assert pytest.approx(C, rel=2e-3) == found.twin.C
