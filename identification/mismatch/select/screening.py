"""Which term would help: change of the whitened prediction by a little of each, against the whitened residual.

A little of every term in every form, at a few inner settings, gives a direction (tangent space of the present model).
What the present model's own parameters can follow is projected out (Frisch and Waugh). The largest correlation of all
is judged against the largest of its own null distribution: directions are correlated, so that is drawn from the data,
by changing the sign of whole blocks of the residual at random (symmetric noise of any colour within a block).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.singular_values import thin_svd
from identification.estimation.tails import normal_sf
from identification.mismatch import policy
from identification.mismatch.estimate.fitting import Fit, raw, residual_of, ticks_told
from identification.mismatch.model.data import Data
from identification.mismatch.model.whitening import Weights
from identification.mismatch.select.jumps import likeliest_jumps
from identification.mismatch.select.ringing import likeliest_rings
from identification.physics.term import Term
from identification.recording import Floats

VALLEYS = 3
"""Delays round which the likeliest is sought: ticks make a valley at each of a few."""
CLOSELY = np.linspace(0.85, 1.15, 21)
"""Of such a delay: factors that are tried, fine enough for the fit to find the bottom."""
SURROGATES = 1000
"""Draws of the null distribution: 1 % of them are ten, and beyond them its tail is fitted."""
BLOCKS = 120
"""Blocks whose signs are drawn, at most: more would be shorter, and noise is correlated within them."""
MOST_PLAIN = 10
"""Directions taken out, at most: more would take noise with them."""
MOST_JUMPS = 4
"""Instants of a jump of the zero that are tried beside the term's own, the likeliest first."""
MOST_RINGS = 4
"""Frequencies of a ringing stand that are tried beside the term's own, the likeliest first."""
TICKS = (-1, 1, 2, 3)
"""Delays that are tried, in ticks of the command: whole ones look alike."""
SLOW_TICK = 0.5
"""s: a command that changes no faster does not tick on."""
LEAST_DIRECTION = 1e-6
"""Share of a direction that must remain when the present model is projected out."""


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


def lengths(columns: Floats) -> Floats:
    """(q,) Euclidean norms of columns (n, q), without a copy of them."""
    out: Floats = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    return out


def orthogonal_basis(columns: Floats) -> Floats:
    """(n, r) orthonormal basis of what columns span."""
    if columns.shape[1] == 0:
        return columns
    size = np.linalg.norm(columns, axis=0)
    scaled = columns[:, size > 0] / size[size > 0]
    u, s, _ = thin_svd(scaled)
    out: Floats = u[:, s > 1e-9 * s[0]] if s.size else scaled
    return out


def beside(columns: Floats, basis: Floats) -> Floats:
    """(n, r) columns less what an orthonormal basis (n, p) can follow; without those of which only rounding is left,
    for made unit they would be directions of their own."""
    before = lengths(columns)
    rest = columns - basis @ (basis.T @ columns)
    out: Floats = rest[:, lengths(rest) > LEAST_DIRECTION * before]
    return out


def refined(fit: Fit, data: Data, weights: Weights, term: Term, values: tuple[float, ...]) -> tuple[float, ...]:
    """The best trial closely round `values`, for terms that have such."""
    trials = term.finer(values, data.scale)
    if not trials:
        return values
    if term.traits.delay:
        return _likeliest_delay(fit, data, weights, term, [values, *trials])
    found = directions(fit, data, weights, [term], trials)
    score = np.abs(found.columns.T @ fit.residual)
    return found.values[int(np.argmax(score))] if score.size else values


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
        first = term.parameters(data.scale)[0]
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
            sided.append(first.neutral in (first.low, first.high))
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
    """The term's own; for a jump of the zero, for a delay and for ringing also those that the data point to."""
    found = list(term.trials(data.scale))
    if term.traits.delay:  # ticks of a ramp meet the samples as before only when whole ones have passed
        found += [(k * tick,) for tick in {h.tick for h in data.histories if h.tick < SLOW_TICK} for k in TICKS]
    if term.traits.instant:
        found += [(found[0][0], at) for at in likeliest_jumps(fit, data, weights, basis, MOST_JUMPS)]
    if term.traits.frequency and weights.ticks:
        found += likeliest_rings(fit, data, term, MOST_RINGS)
    return found


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
    return Screening(found, z, plain, _p_value(float(z.max()), null, normal), threshold)


def matching_pursuit(columns: Floats, residual: Floats, least: float, most: int) -> tuple[list[int], Floats]:
    """Indices of unit columns (n, q) that take more than `least` sigma, one after the other, and what is left (n,)."""
    chosen: list[int] = []
    taken = np.empty((residual.size, 0))
    left = residual
    score = columns.T @ left
    size = np.ones(columns.shape[1])
    for _ in range(most):
        z = np.where(size > 1e-2, np.abs(score) / np.maximum(size, 1e-12), 0.0)
        j = int(np.argmax(z)) if z.size else 0
        rest = float(left @ left) - float(z[j] ** 2) if z.size else 0.0
        # Student's t of the direction: what it takes is not held against it
        if not z.size or z[j] ** 2 * max(residual.size - len(chosen) - 1, 1) < least**2 * max(rest, 0.0):
            break
        chosen.append(j)
        q = columns[:, j] - taken @ (taken.T @ columns[:, j])
        q /= np.linalg.norm(q)
        taken = np.column_stack([taken, q])
        left = left - q * (q @ left)
        overlap = columns.T @ q
        size = np.sqrt(np.maximum(size**2 - overlap**2, 0.0))
        score = columns.T @ left
    return chosen, left


def quiet(residual: Floats, columns: Floats) -> Floats:
    """The residual without what is plainly no noise in the span of unit columns: what surrogates are made from."""
    return matching_pursuit(columns, residual, policy.select.PLAIN_DIRECTION_SIGMA, MOST_PLAIN)[1]


def surrogate_scores(columns: Floats, residual: Floats, rng: np.random.Generator) -> Floats:
    """(SURROGATES, q) scores after the signs of blocks of the residual were drawn anew."""
    blocks = min(BLOCKS, max(residual.size // 4, 1))
    edges = np.linspace(0, residual.size, blocks + 1).astype(int)[:-1]
    parts = np.add.reduceat(columns * residual[:, None], edges, axis=0)
    signs = rng.choice((-1.0, 1.0), size=(SURROGATES, blocks))
    out: Floats = signs @ parts
    return out


def normal_scores(columns: Floats, rng: np.random.Generator) -> Floats:
    """(4 SURROGATES, q) scores of white normal residuals."""
    gram = columns.T @ columns
    values, vectors = np.linalg.eigh(gram)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    out: Floats = rng.standard_normal((4 * SURROGATES, values.size)) @ root.T
    return out


def _p_value(largest: float, null: Floats, normal: Floats) -> float:
    """The larger of both; beyond the draws a Gumbel tail fitted to them."""
    found = []
    for draws in (null, normal):
        share = (1 + np.count_nonzero(draws >= largest)) / (1 + draws.size)
        if share > 20 / draws.size:
            found.append(float(share))
            continue
        # tail of the normal maximum: as of one normal deviate, times the number of independent ones it acts like
        at = max(float(np.quantile(draws, 0.95)), 1e-6)
        many = 0.05 / max(float(normal_sf(at)), 1e-300)
        found.append(min(many * float(normal_sf(largest)), float(share)))
    return max(found)
