"""From the baseline to a model: noise first, then the best few candidates fitted jointly, one more term at a time."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.mismatch.coordinates import coordinates
from identification.mismatch.fitting import Fit, at_bound, bounds_of, columns_of, extended, fit, raw
from identification.mismatch.model import Data, Model, Theta, Weights, price, scale_of, weights
from identification.mismatch.noise import Noise, Rows
from identification.mismatch.noise_likelihood import fit_noise
from identification.mismatch.screening import (
    MOST_PLAIN,
    PLAIN,
    Screening,
    directions,
    matching_pursuit,
    orthogonal_basis,
    refined,
    screen,
)
from identification.mismatch.shape_error import allowed, corrections
from identification.physics.catalogue import CATALOGUE
from identification.physics.history import History
from identification.physics.term import Term
from identification.recording import Floats
from identification.tails import chi2_isf

ALARM = 0.01
"""Family-wise false-alarm rate of the search."""
CLOCKS = 0.001
"""s: clocks of two devices are not trusted to agree better, unless stamps are dense and even."""

CANDIDATES = 5
NEARLY = 0.93
"""Of the best gain: a candidate with fewer parameters that reaches it goes first; swaps come later (naming.py)."""
MOST_TERMS = 6
NOISE_ROUNDS = 5
STATIC = ("command_voltage", "thrust")
"""Coordinates of the static curve."""
MOST_STATIC = 2
"""Shapes on the static curve: any curve can be made of more."""
MOVING = {
    "motor_lag",
    "inflow_dynamics",
    "recirculation",
    "heating",
    "reversal_loss",
    "stand_resonance",
    "hysteresis",
    "time_skew",
    "load_cell_creep",
    "zero_drift",
    "zero_offset",
}
"""Not to be seen in a static table."""


@dataclass(frozen=True, eq=False)
class State:
    """A fit with the noise it was judged with."""

    fit: Fit
    noise: Noise
    rate_noise: Noise | None
    weights: Weights
    rows: tuple[Rows, ...]

    @property
    def bic(self) -> float:
        return self.fit.deviance + int(self.fit.free.sum()) * float(np.log(max(self.fit.residual.size, 2)))


def available(data: Data, without: Collection[str] = ()) -> tuple[Term, ...]:
    """Terms of the catalogue whose channels were recorded in every run, but for the effects `without`."""
    have = set.intersection(*(set(h.others) for h in data.histories))
    static = any(h.static for h in data.histories)
    out = []
    for term in CATALOGUE:
        if term.id in without or not set(term.needs) <= have or (static and term.id in MOVING):
            continue
        if data.histories[0].driver_quantity == "rotation_rate" and term.stage in ("command", "rotor"):
            continue
        if term.id == "speed_of_advance" and data.scale.flow <= 0:
            continue
        if (term.id, term.form) == ("supply_sag", "discharge") and (static or "bus_voltage" in have):
            continue  # a proxy
        out.append(term)
    return tuple(out)


def start(histories: Sequence[History]) -> tuple[Data, Theta]:
    """Ordinary least squares of C and the tares, without any weights."""
    gram, right = 0.0, 0.0
    means = []
    for h in histories:
        r = h.rows
        f = h.driver[r] * np.abs(h.driver[r])
        y = h.thrust[r]
        fm, ym = f.mean(), y.mean()
        gram += float(np.sum((f - fm) ** 2))
        right += float(np.sum((f - fm) * (y - ym)))
        means.append((fm, ym))
    C = right / gram if gram > 0 else 0.0
    with_rate = all(h.rate is not None and h.rate_rows.size > 20 for h in histories)
    moving = histories[0].driver_quantity == "command_voltage" and not any(h.static for h in histories)
    most = min(CLOCKS, max(h.jitter for h in histories)) if moving else 0.0
    data = Data(tuple(histories), scale_of(histories, C or 1e-12), with_rate=with_rate, most_shift=most)
    return data, Theta(C, (), tuple(float(ym - C * fm) for fm, ym in means), k=_k(histories))


def _k(histories: Sequence[History]) -> float:
    return float(np.mean([h.rate_per_driver for h in histories]))


def forces(fit_model: Model, theta: Theta, data: Data) -> list[Floats]:
    """Predicted F without tare at the rows."""
    thrust, _ = raw(fit_model, theta, data, with_rate=False)
    return [f - tare for f, tare in zip(thrust, theta.tares, strict=True)]


def refresh(model: Model, theta: Theta, data: Data, extra: Floats | None, state: State | None) -> State:
    """Noise by REML on what the model leaves, the columns of the model (and of what was pursued) taken as fitted."""
    size = forces(model, theta, data)
    thrust, rate = raw(model, theta, data, with_rate=data.with_rate)
    left = [y - f for y, f in zip(data.thrust, thrust, strict=True)]
    unit = _unweighted(data)
    may = np.ones(theta.vector.size, dtype=bool)
    may[-2:] = False
    low, high, _ = bounds_of(model, data, theta)
    may[-3] = high[-3] > low[-3]
    J = columns_of(model, theta, data, unit, may)
    parts = _split(J, data)
    if extra is not None and extra.shape[1]:
        parts = [np.column_stack([p, e]) for p, e in zip(parts, _split(extra, data), strict=True)]
    parts = _independent(parts)
    rows = state.rows if state is not None else data.thrust_rows
    noise = fit_noise(rows, left, parts, size, data.bands)
    rate_noise = None
    if data.with_rate:
        left_rate = [h.rates - f for h, f in zip(data.histories, rate, strict=True)]
        at = [f[:, None] for f in rate]
        rate_noise = fit_noise(
            data.rate_rows,
            left_rate,
            at,
            [np.zeros(r.size) for r in left_rate],
            start=state.rate_noise if state is not None else None,
        )
    w = weights(data, noise, size, rate_noise, rows)
    fitted = fit(model, theta, data, w)
    return State(fitted, noise, rate_noise, w, tuple(rows))


def _unweighted(data: Data) -> Weights:
    white = Noise(1.0, 0.0)
    return weights(
        data,
        white,
        [np.zeros(r.size) for r in data.rows],
        None,
        [replace(r, count=np.ones(r.time.size)) for r in data.thrust_rows],
        unit=True,
    )


def _split(columns: Floats, data: Data) -> list[Floats]:
    ends = np.cumsum([r.size for r in data.rows])
    return list(np.split(columns[: ends[-1]], ends[:-1]))


def _independent(parts: Sequence[Floats]) -> list[Floats]:
    """The same span, orthonormal over all runs together."""
    stacked = np.concatenate(parts)
    size = np.linalg.norm(stacked, axis=0)
    stacked = stacked[:, size > 0] / size[size > 0]
    u, s, _ = np.linalg.svd(stacked, full_matrices=False)
    u = u[:, s > 1e-7 * s[0]] * np.sqrt(stacked.shape[0])
    ends = np.cumsum([p.shape[0] for p in parts])
    return list(np.split(u, ends[:-1]))


def every_shape(fit_now: Fit, data: Data, terms: Sequence[Term]) -> Floats:
    """(n, k) raw columns: all trials of the catalogue's terms, and any shape over each coordinate."""
    columns = np.column_stack(
        [raw_directions(fit_now, data, terms)] + [np.concatenate(c.columns) for c in coordinates(fit_now, data)]
    )
    out: Floats = columns[:, np.linalg.norm(columns, axis=0) > 0]
    return out


def pursue(fit_now: Fit, data: Data, weights: Weights, raw_columns: Floats) -> Floats:
    """(n, k) those of `every_shape` that together take what is plainly no noise.

    Orthogonal matching pursuit. Noise is estimated beside these columns, or a mismatch would be mistaken for it.
    """
    thrust_only = Weights(weights.thrust)
    n = data.size
    columns = thrust_only.whiten(_split(raw_columns, data), [])
    basis = orthogonal_basis(fit_now.jacobian[:n])
    columns = columns - basis @ (basis.T @ columns)
    first = np.linalg.norm(columns, axis=0)
    columns = np.where(first > 1e-6 * np.median(first), columns / np.maximum(first, 1e-300), 0.0)
    chosen, _ = matching_pursuit(columns, fit_now.residual[:n], PLAIN, MOST_PLAIN)
    out: Floats = raw_columns[:, chosen]
    return out


def raw_directions(fit_now: Fit, data: Data, terms: Sequence[Term]) -> Floats:
    """(n, q) change of the thrust by each trial of each term."""
    base, _ = raw(fit_now.model, fit_now.theta, data, with_rate=False)
    columns = []
    for term in terms:
        bigger = fit_now.model.plus(term)
        for trial in term.trials(data.scale):
            theta = extended(fit_now.theta, fit_now.model, term, trial, bigger)
            new, _ = raw(bigger, theta, data, with_rate=False)
            columns.append(np.concatenate(new) - np.concatenate(base))
    return np.column_stack(columns) if columns else np.empty((data.size, 0))


def baseline(data: Data, theta: Theta, terms: Sequence[Term], model: Model) -> State:
    """C V|V|, what is given and tares, with the noise that remains when what is plainly no noise is taken out.

    The noise is first all that is left; what stands out of even that is taken out, and so on: slow noise has many
    shapes by chance, and taken out at once they would make it look smaller than it is.
    """
    unit = _unweighted(data)
    first = fit(model, theta, data, unit)
    state = refresh(model, first.theta, data, None, None)
    taken = 0
    shapes = every_shape(state.fit, data, terms)
    for _ in range(NOISE_ROUNDS):
        plain = pursue(state.fit, data, state.weights, shapes)
        if plain.shape[1] <= taken:
            break
        taken = plain.shape[1]
        state = refresh(model, state.fit.theta, data, plain, state)
    return state


@dataclass(frozen=True, eq=False)
class Found:
    """What the search ends with."""

    data: Data
    terms: tuple[Term, ...]
    before: State
    after: State
    screenings: tuple[Screening, ...]
    last: Screening


def accept_threshold(extra: int) -> float:
    return chi2_isf(ALARM / 50, extra)


def search(
    histories: Sequence[History],
    rng: np.random.Generator,
    trace: list[str] | None = None,
    given: Callable[[Data, Theta], tuple[Data, Theta, Model]] | None = None,
    bands: tuple[tuple[float, float], ...] = (),
    without: Collection[str] = (),
) -> Found:
    """Forward: screen, fit the best few, keep the best, refresh the noise; until nothing passes. Then prune.

    `given` puts the baseline of a twin in the place of C V|V|; effects `without` are taken out of the catalogue.
    """
    data, theta = start(histories)
    data, theta, first = given(data, theta) if given is not None else (data, theta, Model())
    data = replace(data, bands=bands)
    terms = available(data, without)
    state = before = baseline(data, theta, terms, first)
    screenings = []
    seen = {frozenset(state.fit.model.terms)}
    while True:
        ids = {t.id for t in state.fit.model.terms}
        left = [t for t in terms if t.id not in ids]
        if sum(set(t.coordinates) <= set(STATIC) for t in state.fit.model.terms) >= MOST_STATIC:
            left = [t for t in left if not set(t.coordinates) <= set(STATIC)]
        found = directions(state.fit, data, state.weights, left)
        spared = allowed(corrections(state.fit, data, state.weights), found.columns)
        judged = screen(state.fit, found, rng, ALARM, spared)
        screenings.append(judged)
        if trace is not None:
            trace.append(
                f"{[t.id for t in state.fit.model.terms]} largest {judged.largest:.1f} of {judged.threshold:.2f} "
                + str([(t.id, t.form, round(z, 1)) for t, _, z in judged.best(6)])
            )
        if judged.largest <= judged.threshold or len(ids) >= MOST_TERMS:
            break
        best = _best_addition(state, judged, data)
        if best is None:
            break
        remaining = [t for t in terms if t.id not in {u.id for u in best.model.terms}]
        plain = pursue(best, data, state.weights, every_shape(best, data, remaining))
        state = refresh(best.model, best.theta, data, plain, state)
        state = prune(state, data)
        if frozenset(state.fit.model.terms) in seen:  # what was added was dropped again
            break
        seen.add(frozenset(state.fit.model.terms))
    return Found(data, terms, before, state, tuple(screenings), judged)


def _best_addition(state: State, judged: Screening, data: Data) -> Fit | None:
    fits = []
    for term, values, _ in judged.best(CANDIDATES):
        bigger = state.fit.model.plus(term)
        begin = refined(state.fit, data, state.weights, term, values)
        theta = extended(state.fit.theta, state.fit.model, term, begin, bigger)
        new = fit(bigger, theta, data, state.weights)
        gain = state.fit.chi2 - new.chi2
        cost = price(term, data) * np.log(new.residual.size)
        if gain > max(cost, np.log(new.residual.size)):
            fits.append((at_bound(term, new, data, state.weights), gain - cost, len(values), new))
    if not fits:
        return None
    possible = [each for each in fits if not each[0]] or fits
    most = max(each[1] for each in possible)
    near = [each for each in possible if each[1] >= NEARLY * most]
    return min(near, key=lambda each: (each[2], -each[1]))[3]


def prune(state: State, data: Data) -> State:
    """Drop terms that no longer earn their place."""
    while state.fit.model.terms:
        costs = []
        for term in state.fit.model.terms:
            smaller = state.fit.model.without(term)
            kept = dict(zip(state.fit.model.terms, state.fit.theta.terms, strict=True))
            theta = replace(state.fit.theta, terms=tuple(kept[t] for t in smaller.terms))
            less = fit(smaller, theta, data, state.weights)
            extra = len(kept[term])
            costs.append((less.chi2 - state.fit.chi2 - accept_threshold(extra), less))
        worst, less = min(costs, key=lambda pair: pair[0])
        if worst > 0:
            break
        state = refresh(less.model, less.theta, data, None, state)
    return state
