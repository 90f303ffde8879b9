"""Least squares on more rows than memory holds: blocks in, one pass, constant memory, the accuracy of QR.

The Gram matrix H'H squares the condition of H, which is why normal equations fail. So a sample of the rows is solved
first: its QR gives a triangle R0 and a solution x0. The pass gathers the Gram matrix of [H R0^-1, y - H x0], whose
condition is near 1, so that nothing is lost. A sample whose columns are far from dependent needs no division: the Gram
matrix of [H, y - H x0] is gathered as it is, straight from the caller's blocks. Where the sample turns out not to stand
for the rest (a block becomes large), the pass goes on with the slower sequence of QR decompositions (TSQR: Demmel and
others, SIAM J. Sci. Comput. 34, 2012), from the triangle that the Gram matrix holds at that moment. Nothing is read
twice. `condense` gives that triangle, which stands for all rows, to whoever wants to put several of them together.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Literal

import numpy as np
from scipy.linalg import solve_triangular
from scipy.linalg.blas import dgemv, dsyrk, dtrsm

from identification.estimation.regression import LinearFit, least_squares
from identification.recording import Floats

Block = tuple[Floats, Floats]
"""Rows of H (k, p) and y (k,). Fastest when H is float64 with each row in one piece (C order): then it is not copied.
The arrays are read before the next block is asked for, so a reader may use the same ones for every block."""
Method = Literal["Gram", "preconditioned Gram", "TSQR", "Gram, then TSQR"]

SAMPLE = 8192
"""Rows of the sample at most; when none is given the first blocks that have so many together stand for the rest."""
WORK = 2**19
"""Bytes of H worked on at a time: they stay in a core's own cache (measured best of 2^15 to 2^20)."""
PLAIN_CONDITION = 100.0
"""Condition of the sample's column-scaled H up to which rows are not divided: its square costs 4 of 16 digits."""
GROWTH = 1e4
"""Mean square of a column in a block, 1 in the sample, above which the sample does not stand for the rest."""
SAMPLE_CONDITION = 1e13
"""Condition of the sample's column-scaled H beyond which rows are not divided by its triangle."""


@dataclass(frozen=True, eq=False)
class Condensed:
    """All rows [H, y] as one triangle: least squares on its p + 1 rows is least squares on them."""

    triangle: Floats
    """(k, p + 1) upper, k <= p + 1."""
    rows: int
    method: Method


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
    _known(sigma)
    found = condense(blocks, len(names), sample)
    if found.rows == 0:
        raise ValueError("stream_least_squares: there are no rows")
    return Streamed(solve(found, names, sigma), found.rows, found.method)


def _known(sigma: float | None) -> None:
    if sigma is not None and not (np.isfinite(sigma) and sigma > 0):
        raise ValueError(f"stream_least_squares: sigma must be finite and above zero, got {sigma}")


def condense(blocks: Iterable[Block], p: int, sample: Block | None = None) -> Condensed:
    """The triangle of all rows of p columns; zeros for no rows. Arguments and errors as
    `stream_least_squares`."""
    checked = _checked(blocks, p)
    start = _start(checked) if sample is None else [*_checked([sample], p)]
    guess = _preconditioner(start) if start else None
    return _pass(chain(start, checked) if sample is None else checked, guess, p)


def _checked(blocks: Iterable[Block], p: int) -> Iterator[Block]:
    """Blocks that have rows."""
    for number, (H, y) in enumerate(blocks):
        if H.ndim != 2 or H.shape[1] != p or y.shape != H.shape[:1]:
            raise ValueError(f"stream_least_squares: block {number}: H {H.shape}, y {y.shape} and {p} names do not fit")
        if len(y):
            yield H, y


def _start(blocks: Iterator[Block]) -> list[Block]:
    """As many blocks as make a sample, copied: the reader may use its arrays again."""
    out: list[Block] = []
    while sum(len(y) for _, y in out) < SAMPLE and (block := next(blocks, None)) is not None:
        out.append((block[0].copy(), block[1].copy()))
    return out


@dataclass(frozen=True, eq=False)
class _Preconditioner:
    """Of the sample: with W = H R0^-1, or W = H when plain, [H, y] = [W, y - H x0] @ back."""

    divisor: Floats
    """R0 (p, p) upper, Fortran order: the sample's H divided by it has columns of mean square 1."""
    solution: Floats
    """x0 (p,)"""
    back: Floats
    """(p + 1, p + 1) upper"""
    largest: Floats
    """(p,) Mean square of a column of W beyond which a block is not what the sample has led to expect."""
    plain: bool
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
    R0, length = triangle[:p, :p], np.linalg.norm(triangle[:p, :p], axis=0)
    condition = np.linalg.cond(R0 / length) if np.all(length > 0) else np.inf
    if condition > SAMPLE_CONDITION:
        return None
    x0 = np.asarray(solve_triangular(R0, triangle[:p, p]), dtype=np.float64)
    back, plain = np.eye(p + 1), bool(condition <= PLAIN_CONDITION)
    back[:p, p] = x0 if plain else triangle[:p, p]
    if not plain:
        back[:p, :p] = R0
    largest = GROWTH * np.square(length / condition) if plain else np.full(p, GROWTH)
    return _Preconditioner(np.asfortranarray(R0), x0, back, largest, plain, n)


def _finite(*arrays: Floats) -> None:
    if not all(np.all(np.isfinite(array)) for array in arrays):
        raise ValueError("stream_least_squares: H and y must be finite; leave out missing samples first")


def _pass(blocks: Iterable[Block], guess: _Preconditioner | None, p: int) -> Condensed:
    gram = _Gram(np.zeros((p, p), order="F"), np.zeros(p), 0.0)
    triangle: Floats | None = np.zeros((0, p + 1)) if guess is None else None
    k = max(WORK // (8 * p), 64)
    work, count = np.empty((k, p)), 0
    for H, y in _pieces(blocks, k):
        count += len(y)
        if guess is not None and triangle is None:
            more = _gram(H, y, guess, work)
            if more is not None:
                gram = gram.plus(more)
                continue
            triangle = gram.root() @ guess.back
        assert triangle is not None
        _finite(H, y)
        triangle = _triangle(np.vstack([triangle, np.column_stack([H, y])]))
    if guess is None:
        assert triangle is not None
        return Condensed(triangle, count, "TSQR")
    if triangle is not None:
        return Condensed(triangle, count, "Gram, then TSQR")
    if count:
        _not_less_than(gram, guess)
    return Condensed(gram.root() @ guess.back, count, "Gram" if guess.plain else "preconditioned Gram")


def _pieces(blocks: Iterable[Block], k: int) -> Iterator[Block]:
    """Views of at most k rows."""
    for H, y in blocks:
        for start in range(0, len(y), k):
            yield H[start : start + k], y[start : start + k]


@dataclass(frozen=True, eq=False)
class _Gram:
    """Gram matrix of [W, r]: W'W (upper half), W'r and r'r."""

    WW: Floats
    Wr: Floats
    rr: float

    def plus(self, other: _Gram) -> _Gram:
        return _Gram(self.WW + other.WW, self.Wr + other.Wr, self.rr + other.rr)

    def root(self) -> Floats:
        """Upper triangle whose square is the matrix, also where that is singular so far."""
        p = len(self.Wr)
        full = np.zeros((p + 1, p + 1))
        full[:p, :p], full[:p, p], full[p, p] = self.WW, self.Wr, self.rr
        length = np.sqrt(np.diagonal(full))
        length = np.where(length > 0, length, 1.0)
        value, vector = np.linalg.eigh(full / np.outer(length, length), UPLO="U")
        return _triangle(np.sqrt(np.maximum(value, 0.0))[:, None] * vector.T) * length


def _gram(H: Floats, y: Floats, guess: _Preconditioner, work: Floats) -> _Gram | None:
    """Of a few rows; None when they are too large for the sample, or not finite."""
    columns = H.T
    left = dgemv(-1.0, columns, guess.solution, 1.0, y, trans=1)
    if not guess.plain:
        divided = work[: len(y)].T
        divided[:] = columns
        columns = dtrsm(1.0, guess.divisor, divided, side=0, lower=0, trans_a=1, overwrite_b=1)
    WW: Floats = dsyrk(1.0, columns)
    Wr: Floats = columns @ left
    rr = float(left @ left)
    fits = np.all(np.diagonal(WW) <= guess.largest * len(y)) and np.isfinite(rr)
    return _Gram(WW, Wr, rr) if fits else None


def _not_less_than(gram: _Gram, guess: _Preconditioner) -> None:
    """The blocks hold the sample's rows, so that in no direction they can have less than it has."""
    WW = np.triu(gram.WW) + np.triu(gram.WW, 1).T
    if guess.plain:
        inverse = solve_triangular(guess.divisor, np.eye(len(WW)))
        WW = inverse.T @ WW @ inverse
    if np.linalg.eigvalsh(WW)[0] < 0.5 * guess.rows:
        raise ValueError(
            "stream_least_squares: the sample must be rows of the blocks themselves, but the blocks excite "
            "some combination of columns less than the sample alone does"
        )


def _triangle(rows: Floats) -> Floats:
    return np.asarray(np.linalg.qr(rows, mode="r"), dtype=np.float64)


def join(parts: Sequence[tuple[Condensed, Sequence[int]]], p: int) -> Condensed:
    """Several sets of rows as one; with each, which of the p columns its own columns are (the others are zero)."""
    stacked = [np.zeros((0, p + 1))]
    for part, columns in parts:
        wide = np.zeros((len(part.triangle), p + 1))
        wide[:, [*columns, p]] = part.triangle
        stacked.append(wide)
    triangle = _triangle(np.vstack([*stacked, np.zeros((p + 1, p + 1))]))
    methods = {part.method for part, _ in parts}
    return Condensed(triangle, sum(part.rows for part, _ in parts), methods.pop() if len(methods) == 1 else "TSQR")


def solve(found: Condensed, names: tuple[str, ...], sigma: float | None = None) -> LinearFit:
    """Least squares of the rows that the triangle stands for; `sigma` as in `stream_least_squares`."""
    _known(sigma)
    p = len(names)
    square = np.zeros((p + 1, p + 1))
    square[: len(found.triangle)] = found.triangle
    unit = 1.0 if sigma is None else sigma
    fit = least_squares(square[:p, :p], square[:p, p], names, unit)
    assert fit.chi2 is not None
    chi2 = fit.chi2 + float(square[p, p] / unit) ** 2
    dof = found.rows - p + (0 if fit.deficiency is None else len(fit.deficiency.combinations))
    fit = replace(fit, residual=np.empty(0), solver=np.empty((p, 0)), dof=dof, chi2=chi2)
    if sigma is not None:
        return fit
    sigma2 = chi2 / dof if dof > 0 else float("nan")
    return replace(fit, cov=fit.cov * sigma2, sigma2=sigma2, chi2=None)
