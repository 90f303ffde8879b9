"""Whether a residual is correlated with its own past: the statistic of Ljung and Box (Biometrika 65, 297, 1978)."""

from __future__ import annotations

from collections.abc import Sequence

from identification.recording import Floats


def ljung_box(parts: Sequence[Floats], lags: Sequence[int]) -> float:
    """Sum of n (n + 2) r_k^2/(n - k) over the lags k of each part (n,), added up over the parts.

    Chi-square of as many degrees of freedom as there are lags in all, where each part is white and of mean 0. A part
    that is 0 throughout adds nothing.

    >>> import numpy as np
    >>> ljung_box([np.array([1.0, -1.0, 1.0, -1.0])], [1])
    4.5
    """
    statistic = 0.0
    for e, most in zip(parts, lags, strict=True):
        n, power = e.size, float(e @ e)
        for k in range(1, most + 1):
            statistic += n * (n + 2) * (float(e[k:] @ e[:-k]) / power) ** 2 / (n - k) if power > 0 else 0.0
    return statistic
