"""Whether what was whitened is white."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.estimation.tails import chi2_sf
from identification.mismatch import policy
from identification.recording import Floats

LAGS = 20
"""Rows apart, at most, whose correlation is looked at; a fifth of a short run."""


def whiteness(residual: Floats, sizes: Sequence[int]) -> float:
    """p-value of Ljung and Box (Biometrika 65, 297, 1978) over LAGS lags of a whitened residual, run by run.

    `residual` (n,): the runs of `sizes` rows one after the other; what comes after them is not looked at.
    """
    ends = np.cumsum(sizes)
    statistic, dof = 0.0, 0
    for part in np.split(residual[: ends[-1]], ends[:-1]):
        n, lags = part.size, min(LAGS, part.size // 5)
        e = np.clip(part - part.mean(), -policy.locate.OUTLIER_SIGMA, policy.locate.OUTLIER_SIGMA)
        power = float(e @ e)
        for k in range(1, lags + 1):
            statistic += n * (n + 2) * (float(e[k:] @ e[:-k]) / power) ** 2 / (n - k) if power > 0 else 0.0
        dof += lags
    return float(chi2_sf(statistic, dof)) if dof else 1.0
