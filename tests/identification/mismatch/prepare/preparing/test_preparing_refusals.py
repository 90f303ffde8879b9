"""What cannot be diagnosed is refused in its sentence; the channel that drives is the best that moves."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.prepare.preparing import Refusal, history_of
from tests.identification.mismatch.prepare.preparing.stepped_recordings import (
    CHANGES,
    COMMAND,
    channel,
    held,
    recording,
)


def refused(*channels):
    found = history_of(recording(*channels))
    assert isinstance(found, Refusal)
    assert found.reason.startswith("run.h5")
    return found.reason


T = np.arange(0, 20, 0.1)


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
