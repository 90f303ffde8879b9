"""Recordings of holds with a known law, made of arrays."""

import numpy as np

from identification.recording import Channel, Recording, Step

BOTH = (0.0, 5.0, -5.0, 10.0, -10.0, 15.0, -15.0, 0.0)
ONE = (0.0, 5.0, 10.0, 15.0, 8.0, 12.0)
"""V, of one direction: C and tare go together."""


def recording(name="a", *, bend=1.0, levels=BOTH, calibration=None, measured=None):
    """Holds of 4 s at 50 Hz. `bend`: share of C at negative voltage; `measured`: calibration of a measured voltage."""
    rng, t = np.random.default_rng(1), np.arange(0.0, 4.0 * len(levels), 0.02)
    V = np.repeat(levels, 200)
    F = 0.4 * V * np.abs(V) * np.where(V < 0, bend, 1.0) + 1.5 + rng.normal(0, 0.1, t.size)
    steps = tuple(Step(i, "hold", V, 4.0 * i, 4.0 * i + 4.0) for i, V in enumerate(levels))
    quantity = "command_voltage" if measured is None else "motor_voltage"
    channels = (
        Channel("u", "motor", quantity, "V", t, V, calibration=measured or {}),
        Channel("f", "cell", "thrust", "N", t, F, calibration=calibration or {}),
    )
    return Recording(name, "T1", channels, steps)
