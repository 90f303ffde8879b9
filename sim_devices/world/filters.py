"""Filters over a whole run at once, for the array form of the effects. Inputs held over each step (zero-order hold)."""

from __future__ import annotations

from math import exp, pi

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

Floats = NDArray[np.float64]


def low_pass(values: Floats, time_constant: float, dt: float) -> Floats:
    """First order: y' = (x - y)/time_constant from y = 0, exact for a held x. `dt` in s."""
    keep = exp(-dt / time_constant)
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], values), dtype=np.float64)


def resonator(values: Floats, frequency: float, damping: float, dt: float) -> Floats:
    """Second order: y'' + 2 damping w y' + w^2 y = w^2 x from rest. `frequency` in Hz, `damping` of critical."""
    w = 2.0 * pi * frequency
    numerator, denominator, _ = cont2discrete(
        (np.array([w * w]), np.array([1.0, 2.0 * damping * w, w * w])), dt, method="zoh"
    )
    late = lfilter(np.ravel(numerator), denominator, values)
    return np.asarray(np.append(late[1:], late[-1]), dtype=np.float64)


def changes(values: Floats) -> NDArray[np.intp]:
    """Indices where the value differs from the one before, the first included."""
    return np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1]).astype(np.intp)


def play(values: Floats, width: float) -> Floats:
    """Play operator y = min(max(y, x - width), x + width) from y = 0."""
    at = changes(values)
    y, kept = 0.0, np.empty(at.size)
    for i, x in enumerate(values[at].tolist()):
        y = min(max(y, x - width), x + width)
        kept[i] = y
    return np.repeat(kept, np.diff(np.append(at, values.size)))


def delayed(values: Floats, delay: float, dt: float) -> Floats:
    """x(t - delay), straight lines between samples, the first value before the start."""
    at = np.arange(values.size, dtype=np.float64)
    return np.interp(at - delay / dt, at, values)
