"""How straight dead weights say a load cell is: what bend they leave it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from identification.calibration.curve import TERMS, Curve
from identification.recording import Floats

COVERED = 0.9
"""Of the forces of a run: weights that reach less far say nothing of how it bends there."""
BENDS = TERMS[1:]


class CellBend(NamedTuple):
    """Standard deviations, each as if it bent that way alone, whatever its gain; 0: the weights do not tell."""

    even: float = 0.0
    """1/N, of F^2."""
    odd: float = 0.0
    """1/N, of F|F|."""
    cubic: float = 0.0
    """1/N^2, of F^3."""


def bend_left(curve: Curve | None, force: Floats) -> CellBend:
    """Of a cell read by its curve, for a run with forces (n,) in N.

    A bend that the calibration could not tell from another is as uncertain as that one over the same range.
    """
    if curve is None or not force.size or not _covers(curve, force):
        return CellBend()
    cov = np.array(curve.covariance)[1:, 1:]
    told = np.flatnonzero(np.diag(cov) > 0.0)
    if not told.size:
        return CellBend()
    information = np.linalg.pinv(cov[np.ix_(told, told)], hermitian=True)
    std = dict(zip((BENDS[i] for i in told), 1.0 / np.sqrt(np.diag(information)), strict=True))
    even, odd = std.get("even", 0.0), std.get("odd", 0.0)
    reach = max(curve.high, -curve.low)
    return CellBend(even, odd, std.get("cubic", odd / reach))


def _covers(curve: Curve, force: Floats) -> bool:
    """Whether weights hung in the directions in which the thruster pushed, as far as it did."""
    return curve.low <= COVERED * min(float(force.min()), 0.0) and curve.high >= COVERED * max(float(force.max()), 0.0)
