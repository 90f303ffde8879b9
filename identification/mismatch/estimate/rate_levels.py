"""What the measured rotation rate says where it stands: the second halves of the levels that were held.

A rotor that moves in a way that no term has (a drive that holds its speed by a loop of its own) makes the noise of its
rate seem loud at all times. The fit then hears little of the levels, which the rate has told to a part in a thousand:
it takes the rate per driver, and curves between the driver and the rotor, from how the rotor moves.
"""

from __future__ import annotations

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.fitting import Fit, raw
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.physics.term import Term
from identification.recording import Floats
from identification.run_history.history import TURNING, History


def rate_by_levels(now: Fit, data: Data) -> tuple[float, float] | None:
    """rev/s per unit of the driver and its standard error by the levels, where these exclude the fitted one."""
    measured, modelled = _levels(now.model, now.theta, data)
    if measured.size < policy.estimate.RATE_LEVELS:
        return None
    ratio, left = _scaled(measured, modelled)
    if not _much_less(left, measured - modelled):
        return None
    error = float(np.sqrt(left @ left / (left.size - 1) / (modelled @ modelled)))
    return now.theta.k * ratio, abs(now.theta.k) * error


def contradiction(term: Term, now: Fit, data: Data) -> str:
    """Why the levels speak against a curve between the driver and the rotor: without it they are predicted far better,
    the rate per driver free in both. Empty where they do not, or where too few were held."""
    with_it = _scaled(*_levels(now.model, now.theta, data))[1]
    without = _scaled(*_levels(*now.less(term), data))[1]
    if without.size < policy.estimate.RATE_LEVELS or not _much_less(without, with_it):
        return ""
    largest = max(float(np.max(np.abs(h.rates))) for h in data.histories)
    off, less = (100 * float(np.max(np.abs(left))) / largest for left in (with_it, without))
    return f"levels of the measured rate are missed by up to {off:.2g} % of the largest, by {less:.2g} % without it"


def _much_less(left: Floats, other: Floats) -> bool:
    return policy.estimate.RATE_LEVELS_RATIO * float(left @ left) < float(other @ other)


def _scaled(measured: Floats, modelled: Floats) -> tuple[float, Floats]:
    """The best multiple of the model, and what it leaves (L,) rev/s."""
    power = float(modelled @ modelled)
    ratio = float(measured @ modelled) / power if power else 0.0
    return ratio, measured - ratio * modelled


def _levels(model: Model, theta: Theta, data: Data) -> tuple[Floats, Floats]:
    """(L,) rev/s, measured and of the model, of all runs."""
    _, predicted = raw(model, theta, data, with_rate=True)
    pairs = [_levels_of(h, rate) for h, rate in zip(data.histories, predicted, strict=True)]
    measured, modelled = (np.concatenate([pair[i] for pair in pairs]) for i in (0, 1))
    return measured, modelled


def _levels_of(history: History, predicted: Floats) -> tuple[Floats, Floats]:
    """(L,) means over the second half of each level that was held long enough and at which the driver drives."""
    rows = history.rate_rows
    starts, level = np.unique(history.level_start, return_inverse=True)
    begin, end = history.edges[starts], np.append(history.edges[starts[1:]], history.edges[-1])
    held = (end - begin > policy.prepare.STEADY_LEVEL) & (np.abs(history.driver[starts]) > TURNING * history.size)
    used = held[level[rows]] & (history.middle[rows] > 0.5 * (begin + end)[level[rows]])
    at, count = level[rows][used], np.bincount(level[rows][used], minlength=starts.size)
    sums = (np.bincount(at, weights=x[used], minlength=starts.size) for x in (history.rates, predicted))
    measured, modelled = (total[count > 0] / count[count > 0] for total in sums)
    return measured, modelled
