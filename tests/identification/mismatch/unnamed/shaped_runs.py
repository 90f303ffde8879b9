"""Runs that hold a shape without a name."""

from __future__ import annotations

import numpy as np

from identification.recording import Channel
from tests.identification.mismatch.small import short


def wet(seed=0, **how):
    t = np.arange(0.0, 80.0, 0.5)
    channels = (
        Channel("w", "w", "water_temperature", "degC", t, 15 + 4 * np.sin(t / 9)),
        Channel("b", "b", "bus_voltage", "V", t, 24 - 0.01 * t + 0.3 * np.cos(t / 5)),
    )
    return short(seed=seed, extra=channels, **how)
