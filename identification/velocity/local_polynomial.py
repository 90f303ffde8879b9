"""Polynomials fitted by least squares (QR) to a window around each sample: what Savitzky and Golay's filter is made of.

Windows of the same shape are done together. On even times they share one set of weights, so the filter is a
convolution; on uneven times each window has a QR of its own, thousands of them in one call.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as fisher

from identification.recording import Floats

Indices = NDArray[np.intp]

EVEN = 1e-6
"""Intervals that differ by less than this share of their mean count as even (their effect on a slope is as small)."""
LOST = 1e-12
"""Smallest over largest diagonal element of R below which a window has too few different times."""
BATCH = 1 << 17
"""Numbers of one batch of windows: keeps the work arrays at a few megabytes."""


@dataclass(frozen=True, eq=False)
class Windows:
    """Around each of some samples: `left` samples before it and `right` after it. All (k,)."""

    centre: Indices
    left: Indices
    right: Indices

    def subset(self, keep: NDArray[np.bool_]) -> Windows:
        return Windows(self.centre[keep], self.left[keep], self.right[keep])


@dataclass(frozen=True, eq=False)
class LocalFits:
    """Of k windows; times count from the centre of each."""

    value: Floats
    """(k, c) the wanted coefficients of 1, u, u^2 ..."""
    cov: Floats
    """(k, c, c) their covariance for noise of unit variance."""
    moment: Floats
    """(k, 2) what the first-order coefficient makes of u^(order + 1) and u^(order + 2)."""
    leverage: Floats
    """(k,) weight of the centre sample in its own smoothed value."""


def is_even(time: Floats) -> bool:
    """True for fewer than three times."""
    step = np.diff(time)
    return bool(step.size < 2 or np.ptp(step) <= EVEN * step.mean())


def coefficient_rows(u: Floats, order: int) -> Floats:
    """(B, order + 1, N) for windows of times u (B, N): rows @ y are the coefficients of 1, u, u^2 ...

    NaN for a window that has not order + 1 different times.

    >>> coefficient_rows(np.array([[-1.0, 0.0, 1.0]]), 1)[0, 0].round(6).tolist()
    [0.333333, 0.333333, 0.333333]
    """
    B, N = u.shape
    if order + 1 > N:
        return np.full((B, order + 1, N), np.nan)
    reach = np.abs(u).max(axis=1)
    reach[reach == 0] = 1.0
    degree = np.arange(order + 1)
    Q, R = np.linalg.qr((u / reach[:, None])[:, :, None] ** degree)
    size = np.abs(np.diagonal(R, axis1=1, axis2=2))
    lost = size.min(axis=1) < LOST * size.max(axis=1)
    R[lost] = np.eye(order + 1)
    rows: Floats = np.linalg.solve(R, Q.transpose(0, 2, 1)) / (reach[:, None] ** degree)[:, :, None]
    rows[lost] = np.nan
    return rows


def _shapes(time: Floats, windows: Windows) -> Iterator[Indices]:
    """Which windows have the same shape, shape by shape."""
    shape = windows.left * (time.size + 1) + windows.right
    order = np.argsort(shape, kind="stable")
    yield from np.split(order, np.flatnonzero(np.diff(shape[order])) + 1)


def _batches(time: Floats, windows: Windows) -> Iterator[tuple[Indices, Floats, Indices]]:
    """(which windows, their times from the centre (1 or B, N), sample numbers (B, N)); one shape in each batch."""
    even = is_even(time)
    for group in _shapes(time, windows):
        around = np.arange(-windows.left[group[0]], windows.right[group[0]] + 1)
        for part in np.array_split(group, -(-group.size * around.size // BATCH)):
            at = windows.centre[part][:, None] + around
            used = at[:1] if even else at
            yield part, time[used] - time[windows.centre[part][: len(used)], None], at


def local_fits(time: Floats, y: Floats, windows: Windows, order: int, wanted: tuple[int, ...]) -> LocalFits:
    """Polynomial of `order` in each window of y (n,) at times (n,); `wanted`: degrees whose coefficients to return."""
    k, c = windows.centre.size, len(wanted)
    out = LocalFits(np.empty((k, c)), np.empty((k, c, c)), np.empty((k, 2)), np.empty(k))
    if is_even(time) and time[-1] > time[0]:
        step = float(time[-1] - time[0]) / (time.size - 1)
        for group in _shapes(time, windows):
            left, right = int(windows.left[group[0]]), int(windows.right[group[0]])
            some = _write_even(out, group, left, _even_shape(left, right, order), step, wanted)
            start = windows.centre[group] - left
            piece = y[start.min() : start.max() + left + right + 1]
            for j, row in enumerate(some):
                out.value[group, j] = np.correlate(piece, row, "valid")[start - start.min()]
        return out
    for part, u, at in _batches(time, windows):
        rows = coefficient_rows(u, order)
        some = rows[:, list(wanted)]
        out.cov[part] = some @ some.transpose(0, 2, 1)
        out.moment[part] = _moments(rows, u)
        out.leverage[part] = rows[:, 0, int(windows.left[part[0]])]
        out.value[part] = np.einsum("bcn,bn->bc", some, y[at])
    return out


def _moments(rows: Floats, u: Floats) -> Floats:
    """(B, 2) what the first-order rows make of the two powers above the order."""
    order = rows.shape[1] - 1
    return np.stack([np.sum(rows[:, 1] * u ** (order + d), axis=1) for d in (1, 2)], axis=1)


@lru_cache(maxsize=4096)
def _even_shape(left: int, right: int, order: int) -> tuple[Floats, Floats]:
    """Rows (order + 1, N) and moments (2,) of a window of even steps of 1 s: computed once for each shape."""
    u = np.arange(-left, right + 1, dtype=float)[None]
    rows = coefficient_rows(u, order)
    shape = rows[0], _moments(rows, u)[0]
    for array in shape:
        array.flags.writeable = False
    return shape


def _write_even(
    out: LocalFits, part: Indices, left: int, shape: tuple[Floats, Floats], step: float, wanted: tuple[int, ...]
) -> Floats:
    """What does not depend on the data, a shape scaled to `step` seconds; returns the wanted rows (c, N)."""
    rows, moment = shape
    order = rows.shape[0] - 1
    some: Floats = rows[list(wanted)] / step ** np.array(wanted, dtype=float)[:, None]
    out.cov[part] = some @ some.T
    out.moment[part] = moment * step ** np.array([order, order + 1.0])
    out.leverage[part] = rows[0, left]
    return some


def significant_orders(
    time: Floats, y: Floats, windows: Windows, lowest: int, highest: int, alpha: float
) -> NDArray[np.intp]:
    """Order (k,) of each window: raised by two from `lowest` while an F test finds the two new terms significant.

    After Barak (Anal. Chem. 67, 1995, 2758), who tests added terms against the residual of the longer polynomial.
    Terms go in pairs because in a symmetric window every second one leaves the slope as it is. Windows too short for
    the test keep `lowest`.
    """
    found = np.full(windows.centre.size, lowest, dtype=np.intp)
    for part, u, at in _batches(time, windows):
        local = y[at] - y[windows.centre[part], None]
        going = np.ones(part.size, dtype=np.bool_)
        for order in range(lowest + 2, highest + 1, 2):
            dof = u.shape[1] - order - 1
            if dof < 1:
                break
            longer, shorter = _residual_power(u, local, order), _residual_power(u, local, order - 2)
            ratio = (shorter - longer) / 2 * dof
            going &= ratio > fisher.ppf(1 - alpha, 2, dof) * longer
            found[part[going]] = order
    return found


def _residual_power(u: Floats, local: Floats, order: int) -> Floats:
    """Sum of squared residuals (B,) of a polynomial of `order` in each window."""
    reach = np.abs(u).max(axis=1, keepdims=True)
    Q, _ = np.linalg.qr((u / reach)[:, :, None] ** np.arange(order + 1))
    if len(u) == 1:
        left = local - (local @ Q[0]) @ Q[0].T
    else:
        left = local - np.einsum("bnk,bk->bn", Q, np.einsum("bnk,bn->bk", Q, local))
    out: Floats = np.sum(left**2, axis=1)
    return out
