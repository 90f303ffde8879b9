"""How well a sweep separates two models: expected chi-square apart, and the probability that the BIC decides rightly.

Everything is linear round the fitted values, and Gaussian: a sweep's whitened rows y are N(f, I + J S J') under a model
with prediction f, slopes J and the covariance S that the data in hand leave. Refitted with both, a model that is wrong
costs (y - f)' (I + J S J')^-1 (y - f), which is what its parameters cannot follow without leaving the data in hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.next_experiment.predicted_response import PredictedResponse
from identification.recording import Floats

DRAWS = 600
"""Runs of a sweep that are drawn for a probability."""
SEED = 20
"""Of these draws: the same question has the same answer."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """What distances are made of, of K blocks (or one sum of some): they add up over blocks.

    Parameters are counted in standard deviations of what the data in hand leave open.
    """

    apart: Floats
    """(K, m, m) d'd, d the difference of two whitened predictions: true model, wrong model."""
    score: tuple[Floats, ...]
    """Per wrong model b: (K, m, q) d' J_b for each true model."""
    gram: tuple[Floats, ...]
    """Per model: (K, q, q) J'J."""

    def __add__(self, other: Pieces) -> Pieces:
        """Of the union; one that has a single block is added to all of the other's."""
        return Pieces(
            self.apart + other.apart,
            tuple(a + b for a, b in zip(self.score, other.score, strict=True)),
            tuple(a + b for a, b in zip(self.gram, other.gram, strict=True)),
        )

    def evenly(self, share: float) -> Pieces:
        """Of all blocks together, each for `share` of its time."""
        return Pieces(
            share * self.apart.sum(axis=0, keepdims=True),
            tuple(share * s.sum(axis=0, keepdims=True) for s in self.score),
            tuple(share * g.sum(axis=0, keepdims=True) for g in self.gram),
        )

    def __getitem__(self, k: int) -> Pieces:
        at = slice(k, k + 1)
        return Pieces(self.apart[at], tuple(s[at] for s in self.score), tuple(g[at] for g in self.gram))


def pieces(views: Sequence[PredictedResponse], block: NDArray[np.intp], many: int) -> Pieces:
    """Of `many` blocks; `block` (n,) says which one each row belongs to, -1 for none."""
    values = np.column_stack([v.value for v in views])
    differences = values[:, :, None] - values[:, None, :]  # (n, true, wrong)
    columns = [v.slopes @ v.root for v in views]
    masks = [np.flatnonzero(block == k) for k in range(many)]
    apart = np.array([np.einsum("nab,nab->ab", differences[r], differences[r]) for r in masks])
    score = tuple(np.array([differences[r][:, :, b].T @ J[r] for r in masks]) for b, J in enumerate(columns))
    return Pieces(apart, score, tuple(np.array([J[r].T @ J[r] for r in masks]) for J in columns))


def distances(found: Pieces) -> Floats:
    """(K, m, m) expected chi-square by which the second model is worse when the first is true."""
    out = found.apart.copy()
    for b, (score, gram) in enumerate(zip(found.score, found.gram, strict=True)):
        solved = np.linalg.solve(np.eye(gram.shape[-1]) + gram, np.swapaxes(score, 1, 2))
        out[:, :, b] -= np.einsum("kap,kpa->ka", score, solved)
    clean: Floats = np.maximum(out, 0.0)
    return clean


def power(true: PredictedResponse, wrong: PredictedResponse, needed: float) -> float:
    """Probability that the wrong model's chi-square grows by more than `needed` over the true one's.

    Draws of noise and of the true model's values as the data in hand leave them, on what either model can say.
    """
    difference = true.value - wrong.value
    own, other = true.slopes @ true.root, wrong.slopes @ wrong.root
    _, small = np.linalg.qr(np.column_stack([difference, own, other]))
    d = small[:, 0]
    A = small[:, 1 : 1 + own.shape[1]]
    B = small[:, 1 + own.shape[1] :]
    rng = np.random.default_rng(SEED)
    y = d[:, None] + A @ rng.standard_normal((A.shape[1], DRAWS)) + rng.standard_normal((d.size, DRAWS))
    fall = _cost(y, B) - _cost(y - d[:, None], A)
    return float(np.mean(fall > needed))


def needed(loss: float, more: int, rows: int, new: int) -> float:
    """Chi-square that `new` rows have to add for a model to be RIVALS_EQUAL_BIC worse than another.

    So far, on `rows`, its BIC is worse by `loss`; it has `more` parameters than the other.
    """
    grown = np.log(rows + new) - np.log(max(rows, 2))
    return float(policy.select.RIVALS_EQUAL_BIC - (loss + more * grown))


def _cost(y: Floats, columns: Floats) -> Floats:
    """(DRAWS,) y' (I + columns columns')^-1 y."""
    inner = np.eye(columns.shape[1]) + columns.T @ columns
    h = columns.T @ y
    out: Floats = np.sum(y**2, axis=0) - np.sum(h * np.linalg.solve(inner, h), axis=0)
    return out
