"""Least squares on more rows than memory holds: blocks in, one pass, constant memory, the accuracy of QR.

The Gram matrix H'H squares the condition of H, which is why normal equations fail. So a sample of the rows [H, y] is
decomposed first: divided by the triangle of that QR, all rows have a condition near 1, and their Gram matrix loses
nothing. Where the sample turns out not to stand for the rest (a block becomes large), the pass goes on with the slower
sequence of QR decompositions (TSQR: Demmel and others, SIAM J. Sci. Comput. 34, 2012), from the triangle that the
Gram matrix holds at that moment. Nothing is read twice.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import chain
from typing import Literal

import numpy as np
from scipy.linalg.blas import dsyrk, dtrsm

from identification.recording import Floats
from identification.regression import LinearFit, least_squares

Block = tuple[Floats, Floats]
"""Rows of H (k, p) and y (k,)."""
Method = Literal["preconditioned Gram", "TSQR", "preconditioned Gram, then TSQR"]

SAMPLE = 8192
"""Rows of the sample at most; when none is given the first blocks that have so many together stand for the rest."""
ROWS = 1024
"""Rows worked on at a time: for a dozen columns they stay in a core's own cache."""
GROWTH = 1e4
"""Mean square of a column in a block, 1 in the sample, above which the sample does not stand for the rest."""
SAMPLE_CONDITION = 1e13
"""Condition of the sample's column-scaled H beyond which rows are not divided by its triangle."""
EXACT = 1e-12
"""A residual of the sample below this share of y counts as this share: data without noise."""


@dataclass(frozen=True, eq=False)
class Streamed:
    """`fit` is as `least_squares` gives it without what grows with the rows: its `residual` and `solver` are empty."""

    fit: LinearFit
    rows: int
    method: Method

    @property
    def statement(self) -> str:
        return f"{self.rows} rows in one pass by {self.method}"


def stream_least_squares(
    blocks: Iterable[Block], names: tuple[str, ...], sigma: float | None = None, sample: Block | None = None
) -> Streamed:
    """LS (eq. 4.5, 4.6, 4.12) of rows that come in blocks; `sigma`: known standard deviation (eq. 4.9, 4.10).

    Rows of different standard deviations: divide them by theirs and give sigma = 1. `sample`: rows taken from all over
    the same data, a few thousand of them (say every 1000th); without it the first blocks have to stand for the rest.
    Raises ValueError for no rows, shapes that do not fit, numbers that are not finite, a sample of other rows.

    >>> H = np.array([[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]])
    >>> found = stream_least_squares([(H[:2], np.array([2.0, 4.0])), (H[2:], np.array([6.0]))], ("a", "b"))
    >>> (found.fit.theta.round(6) + 0.0).tolist(), found.fit.dof, found.rows
    ([2.0, 0.0], 1, 3)
    """
    if sigma is not None and not (np.isfinite(sigma) and sigma > 0):
        raise ValueError(f"stream_least_squares: sigma must be finite and above zero, got {sigma}")
    checked = _checked(blocks, len(names))
    start = _start(checked) if sample is None else [*_checked([sample], len(names))]
    guess = _preconditioner(start) if start else None
    triangle, rows, method = _pass(chain(start, checked) if sample is None else checked, guess, len(names))
    if rows == 0:
        raise ValueError("stream_least_squares: there are no rows")
    return Streamed(_fit(triangle, rows, names, sigma), rows, method)


def _checked(blocks: Iterable[Block], p: int) -> Iterator[Block]:
    """Blocks that have rows."""
    for number, (H, y) in enumerate(blocks):
        if H.ndim != 2 or H.shape[1] != p or y.shape != H.shape[:1]:
            raise ValueError(f"stream_least_squares: block {number}: H {H.shape}, y {y.shape} and {p} names do not fit")
        if len(y):
            yield H, y


def _start(blocks: Iterator[Block]) -> list[Block]:
    """As many blocks as make a sample."""
    out: list[Block] = []
    while sum(len(y) for _, y in out) < SAMPLE and (block := next(blocks, None)) is not None:
        out.append(block)
    return out


@dataclass(frozen=True, eq=False)
class _Preconditioner:
    triangle: Floats
    """(p + 1, p + 1) upper, Fortran order: [H, y] of the sample divided by it has columns of mean square 1."""
    rows: int


def _preconditioner(sample: list[Block]) -> _Preconditioner | None:
    """None when the sample does not tell the columns apart."""
    step = -(-sum(len(y) for _, y in sample) // SAMPLE)
    rows = np.vstack([np.column_stack([H[::step], y[::step]]) for H, y in sample])
    _finite(rows)
    n, p = rows.shape[0], rows.shape[1] - 1
    if n <= p + 1:
        return None
    triangle = _triangle(rows) / np.sqrt(n)
    length = np.linalg.norm(triangle, axis=0)
    if np.any(length == 0) or np.linalg.cond(triangle[:p, :p] / length[:p]) > SAMPLE_CONDITION:
        return None
    if abs(triangle[p, p]) < EXACT * length[p]:
        triangle[p, p] = EXACT * length[p]
    return _Preconditioner(np.asfortranarray(triangle), n)


def _finite(rows: Floats) -> None:
    if not np.all(np.isfinite(rows)):
        raise ValueError("stream_least_squares: H and y must be finite; leave out missing samples first")


def _pass(blocks: Iterable[Block], guess: _Preconditioner | None, p: int) -> tuple[Floats, int, Method]:
    """Triangle (p + 1, p + 1) of all rows [H, y], their number, and how it was found."""
    gram = np.zeros((p + 1, p + 1), order="F")
    triangle: Floats | None = np.zeros((0, p + 1)) if guess is None else None
    buffer, work, count = np.empty((ROWS, p + 1)), np.empty((ROWS, p + 1)), 0
    for rows in _rows(blocks, buffer):
        count += len(rows)
        if guess is not None and triangle is None:
            more = _gram(rows, guess, work)
            if more is not None:
                gram += more
                continue
            triangle = _root(gram) @ guess.triangle
        assert triangle is not None
        _finite(rows)
        triangle = _triangle(np.vstack([triangle, rows]))
    if guess is None:
        assert triangle is not None
        return triangle, count, "TSQR"
    if triangle is not None:
        return triangle, count, "preconditioned Gram, then TSQR"
    if np.linalg.eigvalsh(gram[:p, :p], UPLO="U")[0] < 0.5 * guess.rows:
        raise ValueError(
            "stream_least_squares: the sample must be rows of the blocks themselves, but the blocks excite "
            "some combination of columns less than the sample alone does"
        )
    return _root(gram) @ guess.triangle, count, "preconditioned Gram"


def _rows(blocks: Iterable[Block], buffer: Floats) -> Iterator[Floats]:
    """[H, y], at most as many rows at a time as `buffer` (k, p + 1) has, in `buffer`."""
    for H, y in blocks:
        for start in range(0, len(y), len(buffer)):
            rows = buffer[: min(len(buffer), len(y) - start)]
            rows[:, :-1] = H[start : start + len(rows)]
            rows[:, -1] = y[start : start + len(rows)]
            yield rows


def _gram(rows: Floats, guess: _Preconditioner, work: Floats) -> Floats | None:
    """Upper half of the Gram matrix of the rows divided by the triangle; None when they are too large for it."""
    divided = work[: len(rows)].T
    divided[:] = rows.T
    divided = dtrsm(1.0, guess.triangle, divided, side=0, lower=0, trans_a=1, overwrite_b=1)
    out: Floats = dsyrk(1.0, divided)
    size = np.diagonal(out).max()
    return out if size <= GROWTH * len(rows) else None


def _root(gram: Floats) -> Floats:
    """Upper triangle whose square is the Gram matrix (upper half given), also where that is singular so far."""
    value, vector = np.linalg.eigh(gram, UPLO="U")
    return _triangle(np.sqrt(np.maximum(value, 0.0))[:, None] * vector.T)


def _triangle(rows: Floats) -> Floats:
    return np.asarray(np.linalg.qr(rows, mode="r"), dtype=np.float64)


def _fit(triangle: Floats, rows: int, names: tuple[str, ...], sigma: float | None) -> LinearFit:
    """The same normal equations have the triangle as their regressor: p rows stand for all."""
    p = len(names)
    square = np.zeros((p + 1, p + 1))
    square[: len(triangle)] = triangle
    unit = 1.0 if sigma is None else sigma
    fit = least_squares(square[:p, :p], square[:p, p], names, unit)
    assert fit.chi2 is not None
    chi2 = fit.chi2 + float(square[p, p] / unit) ** 2
    dof = rows - p + (0 if fit.deficiency is None else len(fit.deficiency.combinations))
    fit = replace(fit, residual=np.empty(0), solver=np.empty((p, 0)), dof=dof, chi2=chi2)
    if sigma is not None:
        return fit
    sigma2 = chi2 / dof if dof > 0 else float("nan")
    return replace(fit, cov=fit.cov * sigma2, sigma2=sigma2, chi2=None)
