"""Which term would help: change of the whitened prediction by a little of each, against the whitened residual.

A little of every term in every form, at a few inner settings, gives a direction (tangent space of the present model).
What the present model's own parameters can follow is projected out (Frisch and Waugh). The largest correlation of all
is judged against the largest of its own null distribution (family_wise.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.between_levels import sought
from identification.mismatch.estimate.fitting import Fit, raw, residual_of, ticks_told
from identification.mismatch.estimate.others_follow import OthersFollow
from identification.mismatch.model.data import Data
from identification.mismatch.model.whitening import Weights
from identification.mismatch.select.family_wise import (
    LEAST_DIRECTION,
    lengths,
    normal_scores,
    orthogonal_basis,
    p_of_largest,
    quiet,
    surrogate_scores,
)
from identification.mismatch.select.likeliest_trials import likeliest_jumps, likeliest_rings, sharp_rings
from identification.physics.term import Parameter, Term
from identification.recording import Floats

VALLEYS = 3
"""Delays round which the likeliest is sought: ticks make a valley at each of a few."""
CLOSELY = np.linspace(0.85, 1.15, 21)
"""Of such a delay: factors that are tried, fine enough for the fit to find the bottom."""
MOST_JUMPS = 4
"""Instants of a jump of the zero that are tried beside the term's own, the likeliest first."""
MOST_RINGS = 4
"""Frequencies of a ringing stand that are tried beside the term's own, the likeliest first."""
TICKS = (-1, 1, 2, 3)
"""Delays that are tried, in ticks of the command: whole ones look alike."""
CHANGE = 0.02
"""By which a value of the baseline is moved, relative to it."""
SLOW_TICK = 0.5
"""s: a command that changes no faster does not tick on."""


@dataclass(frozen=True, eq=False)
class Directions:
    """Unit columns, orthogonal to the present model, one per trial."""

    terms: tuple[Term, ...]
    values: tuple[tuple[float, ...], ...]
    one_sided: tuple[bool, ...]
    columns: Floats
    """(n, q)."""
    sizes: Floats
    """(q,) sigma that the trial amount itself is worth."""


@dataclass(frozen=True, eq=False)
class Screening:
    directions: Directions
    z: Floats
    """(q,) sigmas; one-sided ones are 0 where physics has the other sign."""
    plain: Floats
    """(q,) the same before anything was spared for shape error."""
    p_value: float
    """Family-wise, of the largest."""
    threshold: float
    """z that the largest exceeds with SCREENING_FALSE_ALARM."""

    @property
    def largest(self) -> float:
        return float(self.z.max(initial=0.0))

    def best(self, most: int, share: float | None = None) -> list[tuple[Term, tuple[float, ...], float]]:
        """Terms in descending order of z, each form once with its best trial, those within `share` of the best.

        `share`: CANDIDATE_SIGMA_SHARE where nothing is given.
        """
        share = policy.select.CANDIDATE_SIGMA_SHARE if share is None else share
        out: list[tuple[Term, tuple[float, ...], float]] = []
        seen: set[Term] = set()
        for j in np.argsort(-self.plain):
            term = self.directions.terms[j]
            if self.plain[j] < share * self.plain.max() or len(out) >= most:
                break
            if term not in seen:
                seen.add(term)
                out.append((term, self.directions.values[j], float(self.plain[j])))
        return out


def refined(fit: Fit, data: Data, weights: Weights, term: Term, values: tuple[float, ...]) -> tuple[float, ...]:
    """The best trial closely round `values`, for terms that have such."""
    trials = () if fit.model.given_for(term) else term.finer(values, data.scale)
    if any(p.blur > 0 for p in term.parameters(data.scale)):
        return _likeliest_threshold(fit, data, weights, term, [values, *trials])
    if not trials:
        return values
    if term.traits.delay:
        return _likeliest_delay(fit, data, weights, term, [values, *trials])
    found = directions(fit, data, weights, [term], trials)
    score = np.abs(found.columns.T @ fit.residual)
    return found.values[int(np.argmax(score))] if score.size else values


def _likeliest_threshold(
    fit: Fit, data: Data, weights: Weights, term: Term, trials: Sequence[tuple[float, ...]]
) -> tuple[float, ...]:
    others = OthersFollow(fit)

    def chi2(threshold: float) -> float:
        return others.chi2(residual_of(*fit.more(term, (threshold,)), data, weights))

    most = term.parameters(data.scale)[0].high
    near = min((*(threshold for (threshold,) in trials), *_parted(fit, data, weights, term, most)), key=chi2)
    return (sought(near, most, chi2),)


def _parted(fit: Fit, data: Data, weights: Weights, term: Term, most: float) -> list[float]:
    """Where the rows part best, each by its own error: those below as though nothing turned, the others as they are.

    Noise that is slow carries an error that lasts, and shows a threshold only where the command passes it: a valley
    that the trials may lie on either side of.
    """
    with_rate = bool(weights.rate)
    turning, still = (
        raw(*each, data, with_rate=with_rate) for each in ((fit.model, fit.theta), fit.more(term, (most,)))
    )
    size = [np.abs(h.driver[rows]) for h, rows in zip(data.histories, data.rows, strict=True)]
    gain = [_gain(*each) for each in zip(data.thrust, turning[0], still[0], strict=True)]
    if with_rate:
        size += [np.abs(h.driver[h.rate_rows]) for h in data.histories]
        gain += [_gain(h.rates, *each) for h, *each in zip(data.histories, turning[1], still[1], strict=True)]
    level, better = np.concatenate(size), np.concatenate(gain)
    order = np.argsort(level)
    order = order[level[order] < most]
    total = np.cumsum(better[order])
    if not total.size or total.max() <= 0:
        return []
    last = int(np.argmax(total))
    return [float(0.5 * (level[order[last]] + level[order[min(last + 1, order.size - 1)]]))]


def _gain(seen: Floats, turning: Floats, still: Floats) -> Floats:
    """(m,) by which a row is nearer to the second prediction, in mean squares of what the first leaves."""
    left = (seen - turning) ** 2
    return np.asarray((left - (seen - still) ** 2) / max(float(np.mean(left)), 1e-300), dtype=np.float64)


def _likeliest_delay(
    fit: Fit, data: Data, weights: Weights, term: Term, trials: Sequence[tuple[float, ...]]
) -> tuple[float, ...]:
    """The delay that leaves least: ticks that come again and again make a valley at each of them, and the shape of what
    a delay changes does not tell one from the next, its size does."""

    def left(delay: float) -> float:
        bigger, theta = fit.more(term, (delay,))
        residual = residual_of(bigger, replace(theta, shift=0.0), data, weights)
        return float(residual @ residual)

    likely = sorted({delay for (delay,) in trials}, key=left)[:VALLEYS]
    return (min((delay * factor for delay in likely for factor in CLOSELY.tolist()), key=left),)


def directions(
    fit: Fit,
    data: Data,
    weights: Weights,
    terms: Sequence[Term],
    trials: tuple[tuple[float, ...], ...] | None = None,
) -> Directions:
    """Of all trials (their own, or those given) of all terms whose channels were recorded, beside what is fitted.

    A delay takes the place of the small one that the clocks are allowed: ramps in ticks make stairs of it, and the
    slope of one that the small one ends on would hide all others.
    """
    with_rate = bool(weights.rate)
    base_thrust, base_rate = raw(fit.model, fit.theta, data, with_rate=with_rate)
    base_ticks = ticks_told(fit.model, fit.theta, data, weights)
    basis = orthogonal_basis(fit.jacobian)
    used: list[Term] = []
    values: list[tuple[float, ...]] = []
    sided: list[bool] = []
    thrust: list[list[Floats]] = [[] for _ in data.histories]
    rate: list[list[Floats]] = [[] for _ in data.histories]
    ticks: list[list[Floats]] = [[] for _ in base_ticks]
    for term in terms:
        first, changed = term.parameters(data.scale)[0], fit.model.given_for(term) is not None
        for trial in _trials(term, fit, data, weights, basis) if trials is None else trials:
            bigger, theta = fit.more(term, trial)
            new_thrust, new_rate = raw(bigger, theta, data, with_rate=with_rate)
            for i, (new, base) in enumerate(zip(new_thrust, base_thrust, strict=True)):
                thrust[i].append(new - base)
            for i, (new, base) in enumerate(zip(new_rate, base_rate, strict=True)):
                rate[i].append(new - base)
            for column, new, base in zip(ticks, ticks_told(bigger, theta, data, weights), base_ticks, strict=True):
                column.append(new - base)
            used.append(term)
            values.append(trial)
            sided.append(not changed and first.neutral in (first.low, first.high))
    if not used:
        return Directions((), (), (), np.empty((fit.residual.size, 0)), np.empty(0))
    columns = weights.whiten(
        [np.column_stack(c) for c in thrust],
        [np.column_stack(c) for c in rate if c],
        [np.column_stack(c) for c in ticks],
    )
    late = np.array([bool(term.traits.delay) for term in used])
    before = lengths(columns)
    columns -= basis @ ((basis.T @ columns) * ~late)
    if late.any():
        own = orthogonal_basis(fit.jacobian[:, np.flatnonzero(fit.free) != fit.layout.shift])
        columns[:, late] -= own @ (own.T @ columns[:, late])
    return _unit(Directions(tuple(used), tuple(values), tuple(sided), columns, np.empty(0)), before)


def _unit(found: Directions, before: Floats) -> Directions:
    """The columns made unit; without those of which, of lengths `before` (q,), nothing is left. In place."""
    columns = found.columns
    size = lengths(columns)
    good = (size > LEAST_DIRECTION * before) & (size > 0) & np.isfinite(size)
    keep = np.flatnonzero(good)
    if keep.size < good.size:
        columns = columns[:, keep]
    columns /= size[keep]
    return Directions(
        tuple(found.terms[j] for j in keep),
        tuple(found.values[j] for j in keep),
        tuple(found.one_sided[j] for j in keep),
        columns,
        size[keep],
    )


def _trials(term: Term, fit: Fit, data: Data, weights: Weights, basis: Floats) -> list[tuple[float, ...]]:
    """The term's own; for a jump of the zero, for a delay and for ringing also those that the data point to.

    Of one that the baseline has: each of its values moved a little, and a jump to elsewhere, as no slope leads there.
    """
    was = fit.model.given_for(term)
    if was is not None:
        known = term.parameters(data.scale)
        elsewhere = term.finer(was.values, data.scale) if any(p.jumps for p in known) else ()
        return [*_moved(was.values, known), *elsewhere]
    found = list(term.trials(data.scale))
    if term.traits.delay:  # ticks of a ramp meet the samples as before only when whole ones have passed
        found += [(k * tick,) for tick in {h.tick for h in data.histories if h.tick < SLOW_TICK} for k in TICKS]
    if term.traits.instant:
        found += [(found[0][0], at) for at in likeliest_jumps(fit, data, weights, basis, MOST_JUMPS)]
    if term.traits.frequency and weights.ticks:
        found += likeliest_rings(fit, data, term, MOST_RINGS)
    elif term.traits.frequency and data.rings:
        found += sharp_rings(fit, data, weights, basis, term, MOST_RINGS)
    return found


def _moved(values: tuple[float, ...], known: tuple[Parameter, ...]) -> list[tuple[float, ...]]:
    out = []
    for j, (value, p) in enumerate(zip(values, known, strict=True)):
        step = CHANGE * max(abs(value), 0.02 * (p.high - p.low))
        moved = value + step if value + step <= p.high else value - step
        out.append((*values[:j], moved, *values[j + 1 :]))
    return out


def screen(fit: Fit, found: Directions, rng: np.random.Generator, allowed: Floats | None = None) -> Screening:
    """Sigmas of each direction and the family-wise judgement of the largest.

    `allowed` (q,): sigmas of each that the terms found so far may leave behind (shape_error.py).
    """
    alarm = policy.select.SCREENING_FALSE_ALARM
    score = found.columns.T @ fit.residual
    sided = np.array(found.one_sided, dtype=bool)
    plain = np.where(sided, np.maximum(score, 0.0), np.abs(score))
    z = plain if allowed is None else np.maximum(plain - allowed, 0.0)
    if not score.size:
        return Screening(found, z, plain, 1.0, float("inf"))
    null = surrogate_scores(found.columns, quiet(fit.residual, found.columns), rng)
    null = np.where(sided, np.maximum(null, 0.0), np.abs(null)).max(axis=1)
    normal = normal_scores(found.columns, rng)
    normal = np.where(sided, np.maximum(normal, 0.0), np.abs(normal)).max(axis=1)
    threshold = float(max(np.quantile(null, 1 - alarm), np.quantile(normal, 1 - alarm)))
    return Screening(found, z, plain, p_of_largest(float(z.max()), null, normal), threshold)
