"""How far the measured rate is from what a model says of it, without the noise of the rate.

The noise would hide a coupling of the thrust to the rate. What is left of the gap is any curve of the driver, and
beside it what wanders: a share of the driver, or an amount, whichever foretells the rate better. A gap that changes
from row to row, as that of a rotor that lags, is no wandering: it is taken as it was measured, or over few rows. While
the command moves, a reading says when it was taken rather than how far off the rate is: where holds are long enough
only they are asked, unless the gap goes on from row to row and into the holds, as that of a rotor that overshoots.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats
from identification.run_history.filters import reconstructed
from identification.run_history.history import History
from identification.run_history.splines import spline
from identification.run_history.wandering import Smoother

NODES, ROWS_A_NODE = 17, 50
"""Of the curve of the driver, at quantiles of it, at most; and the rows that one takes."""
LEAST_ROWS = 8
SLOW = 4
"""Rows on either side that foretell a row best, where what is seen wanders."""
SLOWER = 0.25
"""Of itself, over as many rows: what changes by less wanders, however plainly each row shows it."""
CALMER = 0.5
"""Of the error with which neighbours foretell a row of the gap: held rows that err less are the ones to be asked."""
OWN, OWN_HELD = 0.1, 0.3
"""Of the square of the gap where the driver moves: what neighbours there err less than goes on from row to row, and
where that of held rows is more the rotor's own way goes on into holds."""
HELD_SHARE = 0.25
"""Of the rows, at rest between two commands: fewer are not all that is known of the gap."""
REACHES = (1, 2, 4, 8, 16, 32, 64, 128)
"""Rows on either side."""


@dataclass(frozen=True, eq=False, slots=True)
class RateGap:
    """What takes the noise out of the gap of one run."""

    smoother: Smoother
    nodes: Floats
    by_share: bool
    asked: NDArray[np.bool_]
    """(m,) rows of the rate that it is found on."""

    def calmed(self, gap: Floats, history: History) -> Floats:
        """(M,) of a gap (m,) at the rows of the rate."""
        c, wandering = self.smoother(gap[self.asked], history.middle)
        out = spline(history.driver, self.nodes, c, 1)
        return out + (history.driver * wandering if self.by_share else wandering)


def rate_gap(history: History) -> RateGap | None:
    """None of a static table, where the gap changes from row to row, and where too few rows tell what wanders."""
    rows = history.rate_rows
    if history.static or history.rate is None or history.rate_sampled is None or rows.size < LEAST_ROWS:
        return None
    asked = asked_rows(history)
    driver, gap = driver_at_rate(history), gap_of_driver(history)
    driver, gap, rows = driver[asked], gap[asked], rows[asked]
    nodes = np.unique(np.quantile(driver, np.linspace(0.0, 1.0, min(NODES, max(rows.size // ROWS_A_NODE, 2)))))
    if nodes.size < 2:
        return None
    columns = spline(driver, nodes, np.eye(nodes.size), 1)
    left = gap - columns @ np.linalg.lstsq(columns, gap, rcond=1e-10)[0]
    one = np.ones_like(gap)
    by_share = running(left, driver).error < running(left, one).error
    basis = driver if by_share else one
    count = one if history.rate_count is None else history.rate_count[rows].astype(np.float64)
    at = history.rate_sampled[rows]
    smoother = Smoother(at, columns, basis, count, gap)
    if smoother.law is None:
        return None
    wanders = smoother.law.frequency * SLOW * float(np.median(np.diff(at))) < SLOWER
    if not wanders and running(gap - columns @ smoother.curve(gap), basis).reach < SLOW:
        return None
    return RateGap(smoother, nodes, by_share, asked)


def gap_of_driver(history: History) -> Floats:
    """(m,) measured rate, in units of the driver, less the driver."""
    assert history.rate is not None
    measured = history.rate[history.rate_rows] / history.rate_per_driver
    return without_ticks(measured - driver_at_rate(history), history)


def asked_rows(history: History) -> NDArray[np.bool_]:
    """(m,) rows of the rate that the gap is found on: those between which the driver is held, where they foretell each
    other far better than all do, and the others do not; the same whatever a fit makes of the driver."""
    driver, gap = driver_at_rate(history), gap_of_driver(history)
    held = held_rows(driver, gap)
    if held.all() or _missed(gap[held], driver[held]) >= CALMER * _missed(gap, driver):
        return np.ones_like(held)
    return np.ones_like(held) if has_own_way(driver, gap, held) else held


def has_own_way(driver: Floats, gap: Floats, held: NDArray[np.bool_]) -> bool:
    """Whether the gap (m,) where the driver (m,) moves is the rotor's own, and no matter of when it was read."""
    moving = float(np.mean(gap[~held] ** 2))
    goes_on = _missed(gap[~held], driver[~held]) < OWN * moving
    return goes_on and float(np.mean(gap[held] ** 2)) > OWN_HELD * moving


def _missed(gap: Floats, driver: Floats) -> float:
    return min(running(gap, np.ones_like(gap)).error, running(gap, driver).error)


def held_rows(driver: Floats, gap: Floats) -> NDArray[np.bool_]:
    """(m,) rows between which the driver moves by less than the rate's noise; all where these are too few."""
    if gap.size < LEAST_ROWS:
        return np.ones(gap.size, dtype=np.bool_)
    step = np.abs(np.diff(driver))
    moves = np.maximum(np.append(step, 0.0), np.append(0.0, step)) / np.sqrt(12)  # of an instant anywhere between two
    noise = float(np.median(np.abs(gap[1:-1] - 0.5 * (gap[2:] + gap[:-2])))) / (0.6745 * np.sqrt(1.5))
    held: NDArray[np.bool_] = moves <= noise
    return held if np.count_nonzero(held) >= max(HELD_SHARE * held.size, LEAST_ROWS) else np.ones_like(held)


def driver_at_rate(history: History) -> Floats:
    """(m,) the driver at the rows of the rate."""
    assert history.rate_sampled is not None
    return reconstructed(history.driver, history.middle, history.rate_sampled)[history.rate_rows]


def without_ticks(gap: Floats, history: History) -> Floats:
    """The gap (m,) less what the ticks of the command do within an interval, as far as the rotor follows them."""
    lead = np.broadcast_to(history.rate_lead, history.driver.shape)[history.rate_rows]
    power = float(lead @ lead)
    followed = min(max(float(gap @ lead) / power, 0.0), 1.0) if power > 0 else 0.0
    return gap - followed * lead


class Running(NamedTuple):
    """A coefficient (n,) over so many neighbours on either side, and its leave-one-out error."""

    coefficient: Floats
    error: float
    reach: int


def running(value: Floats, basis: Floats) -> Running:
    """Running coefficient of value on a basis (n,): over as many neighbours as err least.

    One alone, as measured, errs by what a straight line through both neighbours would.
    """
    if value.size < LEAST_ROWS:
        alone = np.divide(value, basis, out=np.zeros_like(value), where=basis != 0)
        return Running(alone, float(np.mean(value**2)), 0)
    power = np.concatenate([[0.0], np.cumsum(basis**2)])
    product = np.concatenate([[0.0], np.cumsum(basis * value)])
    index = np.arange(value.size)
    tiny = max(1e-9 * float(power[-1]) / value.size, 1e-300)
    alone = value[1:-1] - 0.5 * (value[2:] + value[:-2])
    best = np.divide(value, basis, out=np.zeros_like(value), where=basis**2 > tiny)
    error, width = float(np.mean(alone**2)) if basis.std() == 0 else np.inf, 0
    for reach in REACHES:
        if 2 * reach + 1 > value.size // 4:
            break
        low, high = np.maximum(index - reach, 0), np.minimum(index + reach + 1, value.size)
        b2, by = power[high] - power[low], product[high] - product[low]
        others = np.maximum(b2 - basis**2, tiny)
        missed = float(np.mean((value - basis * (by - basis * value) / others) ** 2))
        if missed < error:
            best, error, width = by / np.maximum(b2, tiny), missed, reach
    return Running(best, error, width)
