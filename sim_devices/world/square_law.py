"""n' = alpha (N|N| - n|n|) for a held N, exactly: a rotor that the water brakes, a column of water that it drags."""

from __future__ import annotations

from math import atan, tan, tanh

import numpy as np
from numpy.typing import NDArray

from sim_devices.world.filters import changes

Floats = NDArray[np.float64]

SHORT = 16
"""points: a shorter segment is quicker step by step."""


def square_law(value: Floats, alpha: float, dt: float) -> Floats:
    """Over a run from 0: segment by segment of a held target, which changes halfway to its first point. `dt` in s."""
    n, old, at = 0.0, 0.0, changes(value)
    out = np.empty_like(value)
    for start, stop, target in zip(at.tolist(), [*at[1:].tolist(), value.size], value[at].tolist(), strict=True):
        n = square_law_step(n, old, alpha, dt / 2.0)
        if stop - start < SHORT:
            n = out[start] = square_law_step(n, target, alpha, dt / 2.0)
            for i in range(start + 1, stop):
                n = out[i] = square_law_step(n, target, alpha, dt)
        else:
            out[start:stop] = _path(n, target, alpha, (np.arange(stop - start) + 0.5) * dt)
            n = float(out[stop - 1])
        old = target
    return out


def square_law_step(n: float, target: float, alpha: float, t: float) -> float:
    """Solve n' = alpha (N|N| - n|n|) over t (s), N the target, exactly.

    With N >= 0 (else mirrored): n = N (n0 + N tanh)/(N + n0 tanh) from n0 >= 0, and with tan and a minus sign below 0
    until it crosses there; tanh and tan of alpha N t.
    """
    if target < 0.0:
        return -square_law_step(-n, -target, alpha, t)
    if target == 0.0:
        return n / (1.0 + alpha * abs(n) * t)
    if n < 0.0:
        crossing = atan(-n / target) / (alpha * target)
        if t < crossing:
            turn = tan(alpha * target * t)
            return target * (n + target * turn) / (target - n * turn)
        n, t = 0.0, t - crossing
    turn = tanh(alpha * target * t)
    return target * (n + target * turn) / (target + n * turn)


def _path(n: float, target: float, alpha: float, t: Floats) -> Floats:
    """The same at each time of t (n,)."""
    if target < 0.0:
        return -_path(-n, -target, alpha, t)
    if target == 0.0:
        return np.asarray(n / (1.0 + alpha * abs(n) * t))
    crossing = atan(max(-n, 0.0) / target) / (alpha * target)
    turn = np.tan(alpha * target * np.minimum(t, crossing))
    backwards = target * (n + target * turn) / (target - n * turn)
    turn, n = np.tanh(alpha * target * (t - crossing)), max(n, 0.0)
    return np.where(t < crossing, backwards, target * (n + target * turn) / (target + n * turn))
