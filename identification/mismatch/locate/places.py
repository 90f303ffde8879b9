"""Where a residual is: the stretch of a covariate that holds most of it, in figures and in words."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.mismatch import policy
from identification.mismatch.diagnosis import Mismatch
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.locate.residual_structure_test import CovariateTest, residual_structure
from identification.mismatch.model.data import Data
from identification.mismatch.model.predictor import predict
from identification.mismatch.model.whitening import Weights
from identification.mismatch.prepare.preparing import DRIVERS
from identification.mismatch.select.covariates import Covariate
from identification.mismatch.select.exchange.static_pairs import STATIC
from identification.mismatch.select.family_wise import lengths
from identification.mismatch.select.forward_selection import Selected
from identification.mismatch.value import Where
from identification.recording import Floats

SIDES = {
    "direction": ("in reverse", "forward"),
    "direction_of_change": ("where the driver falls", "where the driver rises"),
}
"""Covariates that are a sign: what is told of the negative and of the positive one."""
ROUNDING = 1e-9
"""Of a covariate's reach: such an edge is 0."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where over a covariate the residual is, and its shape."""

    where: Where
    share: float
    """Of the residual, that lies in the stretch."""
    samples: float
    """Of all samples, that lie in it."""
    table: tuple[tuple[float, float, float], ...]
    """(covariate, mean residual in N, its standard error) bin by bin."""
    what: str
    """How a model without the covariate fails there."""


def says(place: Place) -> str:
    """The sentence for a place: a share of the residual means something beside the share of the samples."""
    where = place.where
    if where.quantity in SIDES:  # it has two values or three, and a stretch of it says nothing to a person
        falling, rising = SIDES[where.quantity]
        there = rising if where.low >= 0 else falling if where.high <= 0 else "both ways"
    else:
        unit = "" if where.unit == "1" else f" {where.unit}"
        there = f"at {where.quantity} {where.low:.3g} to {where.high:.3g}{unit}"
    return f"{100 * place.share:.0f} % of the residual lies {there}{_of_all(place.samples)}: {place.what}."


def _of_all(samples: float) -> str:
    """Nothing where it is all of them.

    >>> _of_all(0.084), _of_all(0.002), _of_all(0.997)
    (', with 8 % of the samples', ', with less than 1 % of the samples', '')
    """
    if samples >= 0.995:
        return ""
    return f", with {'less than 1' if samples < 0.01 else f'{100 * samples:.0f}'} % of the samples"


def places_of(found: Selected, after: Estimate, rng: np.random.Generator, *, pulsing: bool) -> tuple[Mismatch, ...]:
    """Where the baseline fails: covariates of what was found first, the clearest first among them.

    Its C and tares are those of the model `after`: with its own it shares out the mismatch over all there is.
    `pulsing`: pulses that come back were found.
    """
    before, data = found.before.fit, found.data
    seen = residual_structure(before, data, found.before.weights, rng, pulsing=pulsing)
    if seen.p_value >= policy.locate.RESIDUAL_FALSE_ALARM and not after.fit.model.terms:
        return ()
    same = replace(before.theta, C=after.fit.theta.C, tares=after.fit.theta.tares, shift=after.fit.theta.shift)
    bare = replace(before, theta=same)
    clear = [g for i, g in enumerate(seen.groups) if i == 0 or g.p_value <= policy.locate.PLACE_P]
    own = {q for term in after.fit.model.terms for c in term.covariates for q in (DRIVERS if c in STATIC else (c,))}
    places = [
        _mismatch(g, bare, data, after.weights) for g in sorted(clear, key=lambda g: g.covariate.quantity not in own)
    ]
    told = [place for place, whole in places if not whole] or [place for place, _ in places]
    return tuple(told[: policy.locate.PLACES_TOLD])


def _mismatch(judged: CovariateTest, bare: Fit, data: Data, weights: Weights) -> tuple[Mismatch, bool]:
    """Of one covariate, and whether it is all of that covariate, which says nothing."""
    place = locate(judged.covariate, bare, data, weights)
    where, table = place.where, place.table
    told = Mismatch("thrust", where, place.share, judged.p_value, says(place))
    return told, where.low <= table[0][0] and where.high >= table[-1][0]


def locate(c: Covariate, fit: Fit, data: Data, weights: Weights) -> Place:
    """The stretch of the covariate that holds most of what its columns make of the residual: noise is everywhere."""
    covariate = np.concatenate(c.values)
    residual = np.concatenate(
        [
            y - predict(fit.model, fit.theta, run, data.scale, tare)[0][r] - tare
            for y, run, r, tare in zip(data.thrust, data.runs, data.rows, fit.theta.tares, strict=True)
        ]
    )
    count = np.concatenate([h.count[r] for h, r in zip(data.histories, data.rows, strict=True)]).astype(np.float64)
    edges = _bins(covariate)
    index = np.clip(np.searchsorted(edges, covariate, side="right") - 1, 0, edges.size - 2)
    k = edges.size - 1
    weight = np.bincount(index, weights=count, minlength=k).astype(np.float64)
    mean = np.bincount(index, weights=count * residual, minlength=k) / np.maximum(weight, 1e-300)
    rows = np.bincount(index, minlength=k)
    spread = np.bincount(index, weights=count * (residual - mean[index]) ** 2, minlength=k) / np.maximum(weight, 1e-300)
    error = np.sqrt(spread / np.maximum(rows, 1))
    structure = _structure(c, residual, data, weights)
    power = np.bincount(index, weights=count * structure**2, minlength=k).astype(np.float64)
    full = rows > 0
    first, last = _stretch(edges, power)
    reach = edges[-1] - edges[0]
    low, high = (0.0 if abs(edge) < ROUNDING * reach else float(edge) for edge in edges[[first, last]])
    center = 0.5 * (edges[1:] + edges[:-1])
    table = tuple((float(center[i]), float(mean[i]), float(error[i])) for i in np.flatnonzero(full))
    share, samples = (_part(of, first, last) for of in (power, weight))
    return Place(Where(c.quantity, low, high, c.unit), share, samples, table, c.what)


def _structure(c: Covariate, residual: Floats, data: Data, weights: Weights) -> Floats:
    """(n,) N, of the residual what any shape over the covariate is: least squares with the coloured noise."""
    thrust = Weights(weights.thrust)
    ends = np.cumsum([r.size for r in data.rows])[:-1]
    columns = thrust.whiten(list(c.columns), [])
    size = lengths(columns)
    unit = columns / np.where(size > 0, size, 1.0)
    left = thrust.whiten(list(np.split(residual, ends)), [])
    inverse = np.linalg.pinv(unit.T @ unit, hermitian=True, rcond=1e-9)
    out: Floats = np.concatenate(c.columns) @ (inverse @ (unit.T @ left) / np.where(size > 0, size, 1.0))
    return out


def _bins(covariate: Floats) -> Floats:
    """About 16 bins: levels where there are few, otherwise of equal numbers."""
    levels = np.unique(np.round(covariate, 9))
    if levels.size <= 24:
        if levels.size == 1:
            return np.array([levels[0] - 0.5, levels[0] + 0.5])
        middle = 0.5 * (levels[1:] + levels[:-1])
        return np.concatenate([[levels[0] - (middle[0] - levels[0])], middle, [levels[-1] + (levels[-1] - middle[-1])]])
    found = np.unique(np.quantile(covariate, np.linspace(0, 1, 17)))
    found[-1] = np.nextafter(found[-1], np.inf)
    return found


def _stretch(edges: Floats, power: Floats) -> tuple[int, int]:
    """Edges of the shortest run of bins that holds PLACE_SHARE of the power, or of the whole."""
    best = (0, power.size)
    total = float(power.sum())
    if total <= 0:
        return best
    cumulative = np.concatenate([[0.0], np.cumsum(power)])
    for i in range(power.size):
        j = int(np.searchsorted(cumulative, cumulative[i] + policy.locate.PLACE_SHARE * total))
        if j <= power.size and edges[j] - edges[i] < edges[best[1]] - edges[best[0]]:
            best = (i, j)
    return best


def _part(of: Floats, first: int, last: int) -> float:
    total = float(of.sum())
    return float(of[first:last].sum()) / total if total > 0 else 0.0
