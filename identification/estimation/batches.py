"""Honest standard errors of a streamed fit: batch sums, gathered in constant memory, say how much noise correlates.

The rows of a recording, in time order, are cut into some dozens of batches of equal length. Noise that forgets within a
batch leaves the batches' scores H_b' e_b independent, whatever its spectrum, so their scatter is the covariance of the
estimate (sandwich). The residual of a batch is smaller than its noise, for the fit has followed it: the correction of
Bell and McCaffrey (Survey Methodology 28, 2002, "CR2") makes it unbiased for white noise, and their degrees of freedom
go with it. All of it follows from the Gram matrices of the batches; the rows are not needed again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from identification.recording import Floats

BATCHES = 64
"""At most; when they are full, neighbours are put together, so that between half of it and all of it are in use."""
FIRST_LENGTH = 32
"""Rows in a batch at the start."""
LEAST_LEFT = 1e-6
"""Share of a direction's information that must lie outside a batch for its residual to be worth correcting."""
SLOW = 3.0
"""Correlation of neighbouring batches, in its own standard deviations, from which noise counts as slower than they."""


class BatchSums:
    """Gathers [H, y - H x0] of one recording in time order; `gram` (B, p + 1, p + 1) are the batches so far."""

    def __init__(self, shift: Floats) -> None:
        """`shift`: x0 (p,), any solution near the final one; it keeps the sums of squares from cancelling."""
        self.shift = shift
        self.length = FIRST_LENGTH
        self._sums = np.zeros((BATCHES, len(shift) + 1, len(shift) + 1))
        self._full = 0
        self._part = 0

    def add(self, H: Floats, y: Floats) -> None:
        """Rows (k, p) and (k,), any number of them."""
        A = np.column_stack([H, y - H @ self.shift])
        while len(A):
            piece = A[: self.length - self._part]
            self._sums[self._full] += piece.T @ piece
            self._part += len(piece)
            A = A[len(piece) :]
            if self._part == self.length:
                self._full, self._part = self._full + 1, 0
                self._halve()

    def _halve(self) -> None:
        if self._full < BATCHES:
            return
        self._full, self.length = BATCHES // 2, 2 * self.length
        self._sums[: self._full] = self._sums[0::2] + self._sums[1::2]
        self._sums[self._full :] = 0.0

    @property
    def gram(self) -> Floats:
        """A last batch that is less than half full is put to the one before it."""
        out = self._sums[: self._full + bool(self._part)].copy()
        if self._full and 0 < 2 * self._part < self.length:
            out[-2] += out[-1]
            out = out[:-1]
        return out


@dataclass(frozen=True, eq=False)
class Sandwich:
    """The covariance of p parameters from how the scores of batches of rows scatter, whatever the noise."""

    cov: Floats
    """(p, p)"""
    dof: Floats
    """(p,) of each parameter's variance: t quantile x std is the half width of its interval."""
    batches: int
    serial: float
    """Correlation of the scores of neighbouring batches; near 0 when the noise forgets within a batch."""
    slow: bool
    """It is above what chance makes: the standard errors are too small."""


def sandwich(triangle: Floats, theta: Floats, series: Sequence[tuple[BatchSums, Sequence[int]]]) -> Sandwich:
    """Covariance of `theta` (p,), least squares on rows whose H has the triangle (p, p).

    `series`: the sums of each recording, and which of the p parameters its columns belong to. Raises ValueError when
    there are no more batches than parameters.
    """
    inverse = solve_triangular(triangle, np.eye(len(theta)))
    parts = [_whitened(sums, columns, theta, inverse) for sums, columns in series]
    G, score = np.concatenate([g for g, _ in parts]), np.concatenate([s for _, s in parts])
    if len(G) <= len(theta):
        raise ValueError(f"sandwich: {len(G)} batches cannot tell the scatter of {len(theta)} parameters")
    share, axes = np.linalg.eigh(G)
    kept = np.maximum(1.0 - share, LEAST_LEFT) ** -0.5
    adjust = (axes * kept[:, None, :]) @ axes.transpose(0, 2, 1)
    adjusted = np.einsum("bij,bj->bi", adjust, score)
    cov = inverse @ (adjusted.T @ adjusted) @ inverse.T
    dof = np.array([_dof(adjust @ row, G) for row in inverse])
    serial, chance = _serial([s for _, s in parts])
    return Sandwich(cov, dof, len(G), serial, serial > SLOW * chance)


def _whitened(sums: BatchSums, columns: Sequence[int], theta: Floats, inverse: Floats) -> tuple[Floats, Floats]:
    """Gram matrices (B, p, p) that sum up to the identity with those of the other series, and scores (B, p)."""
    gram, here = sums.gram, inverse[list(columns)]
    score = gram[:, :-1, -1] - gram[:, :-1, :-1] @ (theta[list(columns)] - sums.shift)
    return here.T @ gram[:, :-1, :-1] @ here, score @ here


def _dof(u: Floats, G: Floats) -> float:
    """Satterthwaite's for the sum of squares of u_b' H_b' e_b, e the residual of white noise; u (B, p), G (B, p, p)."""
    Gu = np.einsum("bij,bj->bi", G, u)
    omega = np.diag(np.einsum("bi,bi->b", u, Gu)) - Gu @ Gu.T
    return float(np.trace(omega) ** 2 / np.sum(omega**2))


def _serial(scores: Sequence[Floats]) -> tuple[float, float]:
    """Correlation of neighbours and its standard deviation when there is none."""
    product = sum(float(np.sum(s[1:] * s[:-1])) for s in scores)
    pairs = sum(s[1:].size for s in scores)
    square = sum(float(np.sum(s * s)) for s in scores)
    count = sum(s.size for s in scores)
    if square == 0.0 or pairs == 0:
        return 0.0, 1.0
    return (product / pairs) / (square / count), float(pairs**-0.5)
