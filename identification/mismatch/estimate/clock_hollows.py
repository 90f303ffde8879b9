"""A fit whose clocks ended in the wrong hollow is begun again in the right one.

A command that ticks moves its samples by whole ticks: chi-square over the shift of a clock has a hollow for every tick
that passes a sample, and a fit stays in the one it began in. What its other values then do to make up for it is a
wrong lag and a wrong C, and looks like a delay or an inertia beside them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

from identification.mismatch import policy
from identification.mismatch.estimate.fitting import Fit, bounds_of, change_of_rates, fit, residual_of
from identification.mismatch.estimate.others_follow import OthersFollow
from identification.mismatch.model.data import Data
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.whitening import Weights
from identification.recording import Floats

Clock = Literal["shift", "rate_shift"]
STEP, FINE = 0.00025, 5
"""s of a first look, a fraction of what an interface takes to hand on a frame; and parts of it of the second."""


def in_best_hollow(found: Fit, data: Data, weights: Weights) -> Fit:
    """The fit, or the better one that begins where chi-square over the clocks is least; its other values taken along.

    As given where no run ticks, or the clocks are known.
    """
    if data.most_shift <= 0 or not any(h.ticks is not None for h in data.histories):
        return found
    for clock in _clocks(found, data, weights):
        begin = _least(found, data, weights, clock)
        if begin is not None:
            other = fit(found.model, begin, data, weights, near=found)
            found = min(found, other, key=lambda each: each.chi2)
    return found


def with_clocks_of(whole: Theta, found: Fit, data: Data, weights: Weights) -> Fit:
    """The fit of a part of the rows with the clocks that all rows had, where this part tells them no better: a few
    microseconds that it does not mind may put a sample that it has not on the other side of a tick."""
    low, high, _ = bounds_of(found.model, data, found.theta)
    free = high[found.layout.shift] > low[found.layout.shift]
    shift = whole.shift if free else found.theta.shift
    kept = replace(found.theta, shift=shift, rate_shift=whole.rate_shift if weights.rate else found.theta.rate_shift)
    left = residual_of(found.model, kept, data, weights)
    if float(left @ left) > found.chi2 + policy.estimate.CLOCK_HOLLOW_CHI2:
        return found
    return replace(found, theta=kept, residual=left)


def by_its_clocks(found: Fit, other: Fit, data: Data, weights: Weights) -> Fit:
    """The fit, or the better one with the clocks of `other`: two terms are to be compared with the same samples on the
    same side of a tick, and a few microseconds may put one on the other."""
    low, high, _ = bounds_of(found.model, data, found.theta)
    free = high[found.layout.shift] > low[found.layout.shift]
    shift = other.theta.shift if free else found.theta.shift
    begin = replace(found.theta, shift=shift, rate_shift=other.theta.rate_shift)
    left = residual_of(found.model, begin, data, weights)
    if not left @ left < found.chi2 - policy.estimate.CLOCK_HOLLOW_CHI2:
        return found
    return min(found, fit(found.model, begin, data, weights, near=found), key=lambda each: each.chi2)


def _clocks(found: Fit, data: Data, weights: Weights) -> Sequence[Clock]:
    low, high, _ = bounds_of(found.model, data, found.theta)
    thrust: Sequence[Clock] = ("shift",) if high[found.layout.shift] > low[found.layout.shift] else ()
    return (*thrust, "rate_shift") if weights.rate else thrust


def _least(found: Fit, data: Data, weights: Weights, clock: Clock) -> Theta | None:
    """Where chi-square is least over one clock, all other values following it to first order; None: where it is."""
    others = OthersFollow(found, found.layout.shift if clock == "shift" else found.layout.rate_shift)

    def left(shift: float) -> Floats:
        moved = _moved(found.theta, clock, shift)
        if clock == "rate_shift":  # the thrust stays
            return found.residual - change_of_rates(found.model, found.theta, moved, data, weights)
        return residual_of(found.model, moved, data, weights)

    def chi2(shift: float) -> float:
        return others.chi2(left(shift))

    many = math.ceil(data.most_shift / STEP)
    step = data.most_shift / many
    coarse = min((step * i for i in range(-many, many + 1)), key=chi2)
    fine = (coarse + step * i / FINE for i in range(-FINE, FINE + 1))
    best = min((shift for shift in fine if abs(shift) <= data.most_shift), key=chi2)
    if not chi2(best) < found.chi2 - policy.estimate.CLOCK_HOLLOW_CHI2:
        return None
    return found.theta.with_vector(others.taken_along(_moved(found.theta, clock, best).vector, left(best)))


def _moved(theta: Theta, clock: Clock, shift: float) -> Theta:
    return replace(theta, shift=shift) if clock == "shift" else replace(theta, rate_shift=shift)
