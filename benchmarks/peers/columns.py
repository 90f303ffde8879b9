"""Our candidate columns as a plain regression that any method can take: what a little of each effect would change.

Every trial of every term of the catalogue, at the tangent of C V|V| and one tare, on the intervals that our own search
works on. C V|V| and tare are projected out of columns and thrust (Frisch and Waugh), rows are weighted by the square
root of their samples, the thrust is in units of the scatter between neighbouring rows, columns have length 1: under
white noise a coefficient is a number of sigmas. Of columns that are one but for rounding the first stays.

Terms that read the measured rotation rate are left out: a dead band and all else that acts before the propeller is
seen in the rate, so its coupling explains the thrust as well as they do. Ours tells them apart by taking the rate as a
second response; a method with one response could not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.mismatch.estimate.fitting import Fit, fit, raw
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.whitening import weights
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.periodic.full_rate import series_of
from identification.mismatch.prepare.preparing import Refusal, history_of
from identification.mismatch.select.baseline import raw_directions, start
from identification.mismatch.select.forward_selection import available
from identification.physics.term import Term
from peers.cases import Puzzle

SAME = 1 - 1e-9
"""Correlation beyond which two columns are one."""


@dataclass(frozen=True, eq=False, slots=True)
class Rows:
    """The thrust of one recording: a row per interval."""

    thrust: np.ndarray
    slope: np.ndarray
    """(n,) V^2, over C."""
    columns: np.ndarray
    """(n, q) N, change by each trial."""
    count: np.ndarray
    """(n,) samples."""

    @property
    def base(self) -> np.ndarray:
        """(n, 2) weighted columns of C and tare."""
        return np.column_stack([self.slope, np.ones(self.slope.size)]) * np.sqrt(self.count)[:, None]


@dataclass(frozen=True, eq=False, slots=True)
class Samples:
    """The thrust of another recording at its samples: what the command does within a row is foreseen."""

    thrust: np.ndarray
    """(N,) N."""
    slope: np.ndarray
    """(N,) V^2, over C."""
    row: np.ndarray
    """(N,) the row of each."""
    columns: np.ndarray
    """(n, q) N, change of each row by each trial."""


@dataclass(frozen=True, eq=False, slots=True)
class Problem:
    """y = A x + noise; `names` (q,) is the effect of each column."""

    A: np.ndarray
    y: np.ndarray
    names: tuple[str, ...]
    fitted: Rows
    unseen: Samples

    def held_out(self, kept: list[int]) -> float:
        """N rms per sample on the unseen recording: kept columns and C by least squares of the fitted one, its tare
        by that of the unseen one."""
        root = np.sqrt(self.fitted.count)
        seen = np.column_stack([self.fitted.base, self.fitted.columns[:, kept] * root[:, None]])
        size = np.linalg.norm(seen, axis=0)
        found = np.linalg.lstsq(seen / size, self.fitted.thrust * root, rcond=1e-12)[0] / size
        u = self.unseen
        return float(np.std(u.thrust - u.slope * found[0] - (u.columns[:, kept] @ found[2:])[u.row]))


def problem(puzzle: Puzzle) -> Problem:
    fitted, unseen = history_of(puzzle.fitted), history_of(puzzle.unseen)
    assert not isinstance(fitted, Refusal)
    assert not isinstance(unseen, Refusal)
    data, theta = start([fitted])
    terms = tuple(t for t in available(data) if "rotation_rate" not in t.needs)
    first = _fit(data, theta)
    there = Data((unseen,), data.scale)
    far = _fit(there, Theta(first.theta.C, (), (0.0,)), steps=0)
    names = [t.id for t in terms for _ in t.trials(data.scale)]
    return _plain(_rows(first, data, terms), _samples(far, there, terms), names)


def _fit(data: Data, theta: Theta, steps: int = 25) -> Fit:
    white = weights(data, Noise(1.0, 0.0), [np.zeros(r.size) for r in data.rows], None)
    return fit(Model(), theta, data, white, steps)


def _rows(first: Fit, data: Data, terms: tuple[Term, ...]) -> Rows:
    (history,) = data.histories
    (force,), _ = raw(Model(), first.theta, data, with_rate=False)
    r = history.rows
    slope = (force - first.theta.tares[0]) / first.theta.C
    return Rows(history.thrust[r], slope, raw_directions(first, data, terms), history.count[r].astype(np.float64))


def _samples(far: Fit, there: Data, terms: tuple[Term, ...]) -> Samples:
    (history,), (series,) = there.histories, series_of(far, there)
    slope = (history.sample_thrust - series.residual - far.theta.tares[0]) / far.theta.C
    interval = np.searchsorted(history.edges, series.time, side="right") - 1
    row = np.searchsorted(history.rows, np.clip(interval, 0, history.driver.size - 1))
    return Samples(history.sample_thrust, slope, row, raw_directions(far, there, terms))


def _plain(seen: Rows, there: Samples, names: list[str]) -> Problem:
    root = np.sqrt(seen.count)
    Q, _ = np.linalg.qr(seen.base)
    A = seen.columns * root[:, None]
    before = np.linalg.norm(A, axis=0)
    A = A - Q @ (Q.T @ A)
    size = np.linalg.norm(A, axis=0)
    good = np.flatnonzero((size > 1e-6 * before) & np.isfinite(size) & (size > 0))
    A = A[:, good] / size[good]
    first = ~(np.triu(np.abs(A.T @ A), 1) > SAME).any(axis=0)
    good = good[first]
    y = seen.thrust * root
    y = y - Q @ (Q.T @ y)
    scatter = float(np.median(np.abs(np.diff(y)))) / (0.6745 * np.sqrt(2))
    kept = replace(seen, columns=seen.columns[:, good]), replace(there, columns=there.columns[:, good])
    return Problem(A[:, first], y / scatter, tuple(names[j] for j in good), *kept)
