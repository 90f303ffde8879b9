"""Filters over a whole run at once, for the array form of the effects.

An input is held and changes halfway between grid points: that is where the command of a sweep changes.
scipy is imported where it is used: the live bench steps, and its commands must start quickly.
"""

from __future__ import annotations

from math import exp, pi, sqrt

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def low_pass(values: Floats, time_constant: float, dt: float) -> Floats:
    """First order: y' = (x - y)/time_constant from y = 0, exact for a held x. `dt` in s."""
    from scipy.signal import lfilter

    keep = exp(-dt / time_constant)
    half = sqrt(keep)
    return np.asarray(lfilter([1.0 - half, half - keep], [1.0, -keep], values), dtype=np.float64)


def resonator(values: Floats, frequency: float, damping: float, dt: float) -> Floats:
    """Second order: y'' + 2 damping w y' + w^2 y = w^2 x from rest. `frequency` in Hz, `damping` of critical."""
    from scipy.linalg import expm
    from scipy.signal import lfilter

    w = 2.0 * pi * frequency
    # x_i = half (half x_{i-1} + push u_{i-1}) + push u_i, position first, with half and push over dt/2
    step = expm(np.array([[0.0, 1.0, 0.0], [-w * w, -2.0 * damping * w, w * w], [0.0, 0.0, 0.0]]) * dt / 2.0)
    half, push = step[:2, :2], step[:2, 2]
    whole = half @ half
    turned = np.trace(whole) * np.eye(2) - whole
    numerator = [push[0], (half @ push - turned @ push)[0], -(turned @ half @ push)[0]]
    return np.asarray(lfilter(numerator, [1.0, -np.trace(whole), np.linalg.det(whole)], values), dtype=np.float64)


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
    """x(t - delay) to the nearest grid point, the first value before the start."""
    late = min(round(delay / dt), values.size)
    return np.concatenate([np.full(late, values[0]), values[: values.size - late]])
