"""Exact Gaussian inner products under a noise law: K = diag(white variance) + sum of Markov processes.

The inverse of a Markov process is banded, so by Woodbury's identity every product with K^-1 costs one banded solve:
K^-1 = D^-1 - D^-1 H M^-1 H' D^-1 with M = Q + H' D^-1 H, Q the joint inverse covariance of the latent processes and H
how much of each reaches a sample: all of it, of unrest its size there.
"""

from __future__ import annotations

from math import exp

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

from sim_devices.world.noise_law import NoiseLaw, Peak, Slow, peak_coefficients

Floats = NDArray[np.float64]


class Whitening:
    """K^-1 of one uninterrupted series of n samples at `rate` (1/s); proportional noise follows `value` (n,)."""

    def __init__(self, law: NoiseLaw, value: Floats, rate: float) -> None:
        self._precision = 1.0 / law.white_std(value) ** 2
        latents: list[Slow | Peak] = [*law.slow, *([law.peak] if law.peak else [])]
        self._reach = np.ones((value.size, len(latents)))
        if law.unrest:
            latents.append(Slow(1.0, law.unrest.time_constant))
            self._reach = np.column_stack([self._reach, law.unrest.size(value, rate)])
        self._factor = self._factorised(latents, value.size, rate) if latents else None

    def _factorised(self, latents: list[Slow | Peak], n: int, rate: float) -> Floats:
        """Cholesky factor (lower band) of M, latents of one instant side by side."""
        parts = len(latents)
        longest = 2 if any(isinstance(latent, Peak) for latent in latents) else 1
        band = np.zeros((max(parts * longest, parts - 1) + 1, n * parts))
        for j, latent in enumerate(latents):
            diagonals = _ar2(latent, n, rate) if isinstance(latent, Peak) else _ar1(latent, n, rate)
            for lag, diagonal in enumerate(diagonals):
                band[lag * parts, j::parts][: n - lag] += diagonal
        for j in range(parts):
            for other in range(j, parts):
                band[other - j, j::parts] += self._precision * self._reach[:, j] * self._reach[:, other]
        return np.asarray(cholesky_banded(band, lower=True, check_finite=False, overwrite_ab=True))

    def solve(self, columns: Floats) -> Floats:
        """K^-1 times (n, k)."""
        light = self._precision[:, None] * columns
        if self._factor is None:
            return np.asarray(light)
        spread = (light[:, None, :] * self._reach[:, :, None]).reshape(self._reach.size, -1)
        latent = cho_solve_banded((self._factor, True), spread, check_finite=False)
        explained = (latent.reshape(*self._reach.shape, -1) * self._reach[:, :, None]).sum(axis=1)
        return np.asarray(light - self._precision[:, None] * explained)


def _ar1(slow: Slow, n: int, rate: float) -> tuple[Floats, Floats]:
    """Diagonals of the inverse covariance of a stationary first-order process."""
    keep = exp(-1.0 / (rate * slow.time_constant))
    inner = np.full(n, 1.0 + keep * keep)
    inner[[0, -1]] = 1.0
    push = slow.std**2 * (1.0 - keep * keep)
    return inner / push, np.full(n - 1, -keep / push)


def _ar2(peak: Peak, n: int, rate: float) -> tuple[Floats, Floats, Floats]:
    """Diagonals of the inverse covariance of a stationary AR(2) process (Galbraith & Galbraith 1974)."""
    a, b, push = peak_coefficients(peak, rate)
    main, first = np.full(n, 1.0 + a * a + b * b), np.full(n - 1, -a * (1.0 - b))
    main[[0, -1]], main[[1, -2]] = 1.0, 1.0 + a * a
    first[[0, -1]] = -a
    scale = push * push
    return main / scale, first / scale, np.full(n - 2, -b / scale)
