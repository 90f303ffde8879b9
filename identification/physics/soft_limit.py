"""A limit with a knee: nothing is lost up to its onset; beyond, less and less is passed on until nothing more is.

    g(a) = a - bend e^2 / 2, e = min(max(a - onset, 0), 1 / bend), and beyond the knee onset + 1 / (2 bend)

The slope falls evenly from 1 to 0 over a knee of width 1 / bend (Giannoulis, Massberg and Reiss 2012, eq. 4, at an
infinite ratio). `a` and the onset have one unit, the bend its inverse; arrays have one shape.
"""

from __future__ import annotations

import numpy as np

from identification.recording import Floats


def limited(size: Floats, half: Floats, bend: float, onset: float) -> Floats:
    """Mean of g(size + u), u even within +-half (> 0).

    >>> limited(np.array([1.0, 3.0, 4.0, 9.0]), np.full(4, 1e-6), 0.5, 2.0).round(6).tolist()
    [1.0, 2.75, 3.0, 3.0]
    """
    e = size - onset
    out: Floats = size - (_lost(e + half, bend) - _lost(e - half, bend)) / (2 * half)
    return out


def _lost(e: Floats, bend: float) -> Floats:
    """Integral of a - g(a) from the onset to `e` beyond it."""
    knee = 1 / bend if bend > 0 else np.inf
    within, beyond = np.clip(e, 0.0, knee), np.maximum(e - knee, 0.0)
    out: Floats = bend * within**3 / 6 + (0.5 * beyond * (beyond + knee) if bend > 0 else 0.0)
    return out


def knee(name: str, bend: float, onset: float) -> tuple[str, ...]:
    """Of a variable of either sign what g makes of it, to be typed in.

    >>> knee("V", 0.5, 2.0)
    ('over = clip(abs(V) - 2, 0, 2)', 'V = sign(V) * (minimum(abs(V), 4) - 0.25 * over ** 2)')
    """
    width = 1 / bend if bend > 0 else np.inf
    return (
        f"over = clip(abs({name}) - {onset:.6g}, 0, {width:.6g})",
        f"{name} = sign({name}) * (minimum(abs({name}), {onset + width:.6g}) - {bend / 2:.6g} * over ** 2)",
    )


def mean_slope(size: Floats, half: Floats, bend: float, onset: float) -> Floats:
    """Share of a motion of +-half (> 0) round `size` that is passed on.

    >>> mean_slope(np.array([1.0, 3.0, 9.0]), np.full(3, 1e-6), 0.5, 2.0).round(6).tolist()
    [1.0, 0.5, 0.0]
    """
    high, low = (_passed(size - onset + side, bend) for side in (half, -half))
    out: Floats = (high - low) / (2 * half)
    return out


def _passed(e: Floats, bend: float) -> Floats:
    """What is passed at `e` beyond the onset, less the onset."""
    within = np.clip(e, 0.0, 1 / bend if bend > 0 else np.inf)
    out: Floats = np.minimum(e, 0.0) + within - 0.5 * bend * within**2
    return out


def slope_at(passed: Floats, bend: float, onset: float) -> Floats:
    """Slope where g is `passed`.

    >>> slope_at(np.array([1.0, 2.75, 3.0]), 0.5, 2.0).tolist()
    [1.0, 0.5, 0.0]
    """
    out: Floats = np.sqrt(np.clip(1 - 2 * bend * (passed - onset), 0.0, 1.0))
    return out
