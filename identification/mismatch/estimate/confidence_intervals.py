"""95 % intervals from the likelihood: chi-square, least over all other parameters, has risen by 3.84 at their ends.

Where chi-square is a parabola that is the value +- 1.96 standard errors, and two looks are enough to know it. It is
none for the time constant of a faint effect, nor for the instant of a jump and a threshold between two levels: of those
twice the log of the likelihood ratio is the maximum of two Brownian motions that drift away, P(< c) = (1 - exp(-c/2))^2
(Hansen, Econometrica 68, 575, 2000, eq. 8).
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import partial
from math import hypot, log, sqrt

import numpy as np
from numpy.typing import NDArray

from identification.mismatch.estimate.bounded_least_squares import LEAST_REACH
from identification.mismatch.estimate.fitting import Fit, bounds_of, columns_of, residual_of
from identification.mismatch.model.data import Data, hidden_by_steps
from identification.mismatch.model.whitening import Weights
from identification.mismatch.value import QUANTILE
from identification.physics.term import Parameter, Term
from identification.recording import Floats

JUMPS = sqrt(-2 * log(1 - sqrt(0.95)))
"""The same where the prediction jumps at the parameter: root of the rise of chi-square at the ends."""
NEAR = 0.15
"""Of the root of the rise: how closely the root of the rise of chi-square is met at an end, the rest in proportion."""
NARROW = 0.1
"""Of the distance to an end: a bracket as narrow as this ends where chi-square has risen."""
MOST_LOOKS = 16
"""At chi-square, for one end: a bracket halves each time, so that sixteen are precise."""
GROWTH = 1.5, 8.0
"""Least and most factor by which the distance grows until chi-square has risen."""
LEAST_STEP = 0.03
"""Of the step of a slope: standard errors below it are the slope of a stair."""
REFITS = 6
"""Steps of the other parameters at one value of the profiled one: they begin near."""
SHORTER = 0.3
"""Of a step that foretold too much: how much of it is tried next."""
FITTED = 0.2
"""Fall of chi-square at which the other parameters are as good as fitted."""
MUCH = 1.3
"""Of the rise that standard errors foretell: above it, whether clocks that stay do better is asked."""
AS_FORETOLD = 0.7
"""Of the fall foretold: where less comes of a step, the slopes are taken anew."""


@dataclass(frozen=True, slots=True)
class Interval:
    low: float
    high: float


def intervals(fitted: Fit, data: Data, weights: Weights, terms: Collection[Term]) -> dict[Term, tuple[Interval, ...]]:
    """Of all parameters of those of its `terms`. Of a delay no closer than what the recordings say of their own, of an
    amount no closer than the steps of the channel that it goes with let it be."""
    out = {}
    for term, values in fitted.values.items():
        if term in terms:
            at = fitted.layout.of(term).start
            known = enumerate(zip(term.parameters(data.scale), values, strict=True), at)
            late = max(h.delay_std for h in data.histories) if term.traits.delay else 0.0
            hidden = hidden_by_steps(term, data)
            out[term] = tuple(
                _interval(fitted, data, weights, j, p, QUANTILE * hypot(late, hidden * _amount(p, value)))
                for j, (p, value) in known
            )
    return out


def _amount(known: Parameter, value: float) -> float:
    """By how much the parameter is away from where its term is absent; 0 of an inner one."""
    return 0.0 if known.neutral is None else abs(value - known.neutral)


def _interval(fitted: Fit, data: Data, weights: Weights, j: int, known: Parameter, unsure: float = 0.0) -> Interval:
    """Of theta's parameter `j`; `unsure`: how far it may be off, whatever the residual says."""
    _, _, step = bounds_of(fitted.model, data, fitted.theta)
    value = float(fitted.theta.vector[j])
    wanted = JUMPS if known.jumps else QUANTILE
    first = max(wanted * float(np.nan_to_num(fitted.std[j])), LEAST_STEP * float(step[j]))
    profiles = [Rise(fitted, data, weights, j, jumps=known.jumps) for _ in range(2)]
    ends = (_end(p, wanted, value, bound, first) for p, bound in zip(profiles, (known.low, known.high), strict=True))
    # a level so near counts as half beyond a spread threshold, wholly beyond a sharp one
    far = [hypot(abs(end - value) + 0.5 * known.blur, unsure) for end in ends]
    return Interval(max(value - far[0], known.low), min(value + far[1], known.high))


class Rise:
    """The least rise of chi-square where parameter `j` is held elsewhere: of where the clocks follow, and where not.

    In a shift of the clocks the prediction has stairs, an edge at each sample beside a step. A slope foretells none of
    them, so that clocks which follow may end beyond an edge where those that stay are better.
    """

    def __init__(self, fitted: Fit, data: Data, weights: Weights, j: int, *, jumps: bool = False) -> None:
        clocks = (fitted.layout.shift, fitted.layout.rate_shift)
        profile = partial(Profile, fitted, data, weights, j, jumps=jumps)
        self.follow = profile()
        self.stay = profile(still=clocks) if any(fitted.free[clock] and clock != j for clock in clocks) else None
        self.value = float(fitted.theta.vector[j])
        self.std = float(np.nan_to_num(fitted.std[j]))
        self.jumps = jumps

    def __call__(self, value: float) -> float:
        rise = self.follow(value)
        foretold = ((value - self.value) / self.std) ** 2 if self.std > 0 else 0.0
        if self.stay is None or (not self.jumps and rise < MUCH * foretold):
            return rise
        return min(rise, self.stay(value))


class Profile:
    """The rise of chi-square where parameter `j` of theta's vector is held elsewhere and the other free ones follow.

    They follow by Gauss-Newton, each time from where they were last; from the fit where the prediction jumps at `j`.
    One that ended at a bound follows as well, back into what is possible: held there it would be taken for known.
    Those in `still` are held where the fit has them.
    """

    def __init__(
        self, fitted: Fit, data: Data, weights: Weights, j: int, *, jumps: bool = False, still: Collection[int] = ()
    ) -> None:
        self.fitted, self.data, self.weights, self.j, self.jumps = fitted, data, weights, j, jumps
        self.low, self.high, _ = bounds_of(fitted.model, data, fitted.theta)
        which, columns = self._moving()
        moves = np.linalg.norm(columns, axis=0) * (self.high - self.low)[which] > LEAST_REACH
        mine = which == j
        others = moves & ~mine & ~np.isin(which, tuple(still))
        self.follow = np.zeros(fitted.free.size, dtype=bool)
        self.follow[which[others]] = True
        self.slopes = _Slopes.of(columns[:, others])
        # others per unit of j
        self.drawn = -self.slopes.step(columns[:, mine].sum(axis=1))

    def _moving(self) -> tuple[NDArray[np.intp], Floats]:
        """(p,) places in theta's vector of what was free, and of what ended at a bound; slopes (n, p) over them."""
        fitted = self.fitted
        ended = ~fitted.free & (self.high > self.low) & np.isfinite(self.high - self.low)
        ended[fitted.layout.rate_shift] &= bool(self.weights.rate)
        if not ended.any():
            return np.flatnonzero(fitted.free), fitted.jacobian
        slopes = columns_of(fitted.model, fitted.theta, self.data, self.weights, ended)
        which = np.concatenate([np.flatnonzero(fitted.free), np.flatnonzero(ended)])
        order = np.argsort(which)
        return which[order], np.column_stack([fitted.jacobian, slopes])[:, order]

    def __call__(self, value: float) -> float:
        best, others = self.fitted.theta.vector, self.follow
        away = value - best[self.j]
        vector = best.copy()
        vector[self.j] = value
        vector = self._moved(vector, self.drawn * away)
        residual = self._residual(vector)
        share, fresh = 1.0, False
        for _ in range(REFITS):
            step = share * self.slopes.step(residual, *self._room(vector))
            foretold = float(residual @ residual - np.sum((residual - self.slopes.columns @ step) ** 2))
            if foretold < FITTED:
                break
            trial = self._moved(vector, step)
            left = self._residual(trial)
            fall = float(residual @ residual - left @ left)
            if fall > 0:
                vector, residual = trial, left
            elif fresh:
                share *= SHORTER
            if fall < AS_FORETOLD * foretold and not (fresh and fall <= 0):
                theta = self.fitted.theta.with_vector(vector)
                columns = columns_of(self.fitted.model, theta, self.data, self.weights, others)
                self.slopes, fresh = _Slopes.of(columns), True
        if not self.jumps:
            self.drawn = (vector[others] - best[others]) / away
        return float(residual @ residual) - self.fitted.chi2

    def _room(self, vector: Floats) -> tuple[Floats, Floats]:
        """(p,) each: how far those that follow may go down (not above 0) and up."""
        return (self.low - vector)[self.follow], (self.high - vector)[self.follow]

    def _moved(self, vector: Floats, step: Floats) -> Floats:
        out = vector.copy()
        out[self.follow] += step
        return np.clip(out, self.low, self.high)

    def _residual(self, vector: Floats) -> Floats:
        theta = self.fitted.theta.with_vector(vector)
        return residual_of(self.fitted.model, theta, self.data, self.weights)


@dataclass(frozen=True, eq=False, slots=True)
class _Slopes:
    """Columns (n, p), their lengths, and the Gram matrix of columns of unit length."""

    columns: Floats
    size: Floats
    gram: Floats

    @classmethod
    def of(cls, columns: Floats) -> _Slopes:
        size = np.linalg.norm(columns, axis=0)
        size = np.where(size > 0, size, 1.0)
        return cls(columns, size, columns.T @ columns / np.outer(size, size))

    def step(self, residual: Floats, down: Floats | None = None, up: Floats | None = None) -> Floats:
        """(p,) that takes most from a residual (n,).

        What has no room `down` or `up` (p,) where it would go stays, and the others step without it: an active set
        (Nocedal and Wright, Numerical Optimization, 2006, section 16.5).
        """
        right = self.columns.T @ residual / self.size
        still = np.zeros(self.size.size, dtype=bool)
        while True:
            out: Floats = np.zeros(self.size.size)
            go = ~still
            out[go] = np.linalg.pinv(self.gram[np.ix_(go, go)], hermitian=True, rcond=1e-12) @ right[go]
            out /= self.size
            if down is None or up is None:
                return out
            stopped = ((out < 0) & (down >= 0)) | ((out > 0) & (up <= 0))
            if not stopped.any():
                return out
            still |= stopped


def _end(rise: Callable[[float], float], wanted: float, value: float, bound: float, first: float) -> float:
    """Where chi-square has risen by `wanted`^2 on the way from `value` to `bound`, or the bound."""
    most = abs(bound - value)
    if most == 0:
        return value
    sign = 1.0 if bound > value else -1.0
    inside, outside = (0.0, 0.0), (np.inf, np.inf)
    far = min(first, most)
    for _ in range(MOST_LOOKS):
        root = float(np.sqrt(max(rise(value + sign * far), 0.0)))
        if abs(root - wanted) < NEAR * wanted:
            return value + sign * min(far * wanted / root, most)
        if root < wanted:
            if far == most:
                return bound
            inside = far, root
        else:
            outside = far, root
        if np.isinf(outside[0]):
            far = min(far * float(np.clip(wanted / max(root, 1e-3), *GROWTH)), most)
            continue
        width = outside[0] - inside[0]
        if width < NARROW * outside[0]:
            break
        share = (wanted - inside[1]) / (outside[1] - inside[1])
        far = inside[0] + width * float(np.clip(share, 0.25, 0.75))
    return value + sign * (outside[0] if np.isfinite(outside[0]) else inside[0])
