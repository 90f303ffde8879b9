"""Whether what was whitened is white."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.estimation.ljung_box import ljung_box
from identification.estimation.tails import chi2_sf
from identification.mismatch import policy
from identification.recording import Floats

LAGS = 20
"""Rows apart, at most, whose correlation is looked at; a fifth of a short run."""


def whiteness(residual: Floats, sizes: Sequence[int]) -> float:
    """p-value of Ljung's and Box's test over LAGS lags of a whitened residual, run by run.

    `residual` (n,): the runs of `sizes` rows one after the other; what comes after them is not looked at.
    """
    ends = np.cumsum(sizes)
    most = policy.locate.OUTLIER_SIGMA
    parts = [np.clip(part - part.mean(), -most, most) for part in np.split(residual[: ends[-1]], ends[:-1])]
    lags = [min(LAGS, part.size // 5) for part in parts]
    return float(chi2_sf(ljung_box(parts, lags), sum(lags))) if sum(lags) else 1.0
