"""Splines through heights at knots: straight lines between them, or natural cubics."""

from __future__ import annotations

import numpy as np

from identification.recording import Floats


def spline(over: Floats, knots: Floats, heights: Floats, degree: int) -> Floats:
    """Through `heights` at the knots, constant beyond them. `heights` (k,) or (k, p) for p splines at once.

    >>> spline(np.array([-1.0, 0.5, 3.0]), np.array([0.0, 1.0]), np.array([0.0, 2.0]), 1).tolist()
    [0.0, 1.0, 2.0]
    >>> bool(np.allclose(spline(np.array([0.5]), np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0]), 3), 0.5))
    True
    """
    inside = np.clip(over, knots[0], knots[-1])
    if knots.size == 1:
        out: Floats = np.repeat(heights[:1], over.size, axis=0)
        return out
    if degree == 1 and heights.ndim == 1:
        return np.asarray(np.interp(inside, knots, heights), dtype=np.float64)
    if degree == 1:
        j = np.clip(np.searchsorted(knots, inside, side="right") - 1, 0, knots.size - 2)
        w = ((inside - knots[j]) / (knots[j + 1] - knots[j]))[:, None]
        return np.asarray((1 - w) * heights[j] + w * heights[j + 1], dtype=np.float64)
    return _natural(inside, knots, heights)


def _natural(at: Floats, knots: Floats, heights: Floats) -> Floats:
    """Cubic spline without curvature at its ends; scipy.interpolate has it too, and takes a third of a second to load.

    The curvatures at inner knots solve h_- m_- + 2 (h_- + h_+) m + h_+ m_+ = 6 (slope_+ - slope_-).
    """
    width = np.diff(knots)
    shape = (-1,) + (1,) * (heights.ndim - 1)
    slope = np.diff(heights, axis=0) / width.reshape(shape)
    curvature = np.zeros(heights.shape)
    inner = np.diag(2 * (width[:-1] + width[1:])) + np.diag(width[1:-1], 1) + np.diag(width[1:-1], -1)
    curvature[1:-1] = np.linalg.solve(inner, 6 * np.diff(slope, axis=0))
    j = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, knots.size - 2)
    h = width[j].reshape(shape)
    b = (at - knots[j]).reshape(shape) / h
    a = 1 - b
    bent = (a**3 - a) * curvature[j] + (b**3 - b) * curvature[j + 1]
    out: Floats = a * heights[j] + b * heights[j + 1] + h**2 / 6 * bent
    return out
