"""Recordings of a few levels with whatever channels are asked for."""

import numpy as np

from identification.recording import Channel, Recording

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


COMMAND = channel("command_voltage", CHANGES, LEVELS)
