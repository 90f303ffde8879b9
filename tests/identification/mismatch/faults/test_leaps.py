"""A measured rate that leaps where no thrust follows is a fault of the reading; a rotor that turned is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.faults.channel_faults import find_faults, repaired
from identification.recording import Channel, Recording

C, RATE = 0.02, 100.0
"""N s^2, samples/s."""


def run(
    leap: float = -20.0, *, followed: float = 0.0, late: float = 0.0, seconds: float = 0.4, seed: int = 3
) -> Recording:
    """20 s: at rest, then a level of -10 rev/s for 8 s. At 3.9 s the rate leaps and falls back over `seconds`; of what
    goes with that `followed` comes, `late` s after it."""
    t = np.arange(0.0, 20.0, 1 / RATE)
    level = np.where((t > 5.0) & (t < 13.0), -10.0, 0.0)
    spike = np.where((t >= 3.9) & (t < 3.9 + seconds), leap * np.exp(-(t - 3.9) / (seconds / 3)), 0.0)
    rng = np.random.default_rng(seed)
    force = C * level * np.abs(level) + followed * np.interp(t - late, t, C * spike * np.abs(spike))
    thrust = force + 0.2 * rng.standard_normal(t.size)
    rate = level + spike + 0.1 * rng.standard_normal(t.size)
    channels = (
        Channel("rate", "tacho", "rotation_rate", "rev/s", t, rate),
        Channel("thrust", "cell", "thrust", "N", t, thrust),
    )
    return Recording("tank", "T1", channels)


def test_a_leap_that_nothing_follows_is_said_and_not_read():
    recording = run()
    (fault,) = find_faults([recording])
    assert (fault.kind, fault.channel, fault.grave, fault.repairable) == ("leap", "rotation_rate", True, True)
    assert "did not turn" in fault.statement
    assert fault.parameters["start"].value == pytest.approx(3.9, abs=0.03)
    assert fault.parameters["peak"].value == pytest.approx(-20.0, abs=2.0)
    rate = repaired(recording, fault).channels[0]
    unread = np.isnan(rate.value)
    assert np.array_equal(
        unread, (rate.time >= fault.parameters["start"].value) & (rate.time <= fault.parameters["end"].value)
    )
    assert np.nanmax(np.abs(rate.value)) < 11.0


@pytest.mark.parametrize(
    ("recording", "why"),
    [
        (run(followed=1.0), "the thrust came"),
        (run(followed=0.5), "half of it came: physics"),
        (run(followed=1.0, late=0.5), "it came late"),
        (run(leap=-11.0), "the run has as much elsewhere"),
        (run(leap=-20.0, seconds=4.0), "a level, and not a moment"),
        (run(leap=0.0), "nothing leapt"),
    ],
)
def test_a_rotor_that_turned_is_no_fault(recording, why):
    assert find_faults([recording]) == (), why


def test_where_a_command_drives_a_rate_is_judged_by_that():
    recording = run()
    rate, thrust = recording.channels
    volts = np.where((rate.time > 5.0) & (rate.time < 13.0), -10.0, 0.0)
    command = Channel("command", "command", "command_voltage", "V", rate.time, volts)
    assert [f.kind for f in find_faults([replace(recording, channels=(command, rate, thrust))])] == []
