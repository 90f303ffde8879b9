"""A model: C x|x| with terms, one tare a run; its prediction, and the rows in which it meets the measurements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identification.estimation.singular_values import thin_svd
from identification.mismatch.model.step_response import told
from identification.mismatch.noise.covariance import Noise, Rows, Whitener, rows_of
from identification.physics.catalogue import CATALOGUE
from identification.physics.term import STAGES, Parameter, Scale, Term, TermContext
from identification.recording import Floats
from identification.run_history.history import History
from identification.run_history.step_response_rows import TickRows

ORDER = {term: i for i, term in enumerate(sorted(CATALOGUE, key=lambda t: STAGES.index(t.stage)))}
"""Stage by stage, and in the order of the catalogue within one."""

HYDRO = STAGES.index("hydro")
CELL = STAGES.index("cell")
MOST_REMEMBERED = 400


@dataclass(frozen=True, eq=False, slots=True)
class Given:
    """A term of the baseline (a twin's) with its values: not fitted, and none of what may be dropped or swapped."""

    term: Term
    values: tuple[float, ...]
    scale: Scale
    """The sizes that its values refer to."""


@dataclass(frozen=True)
class Model:
    """Terms in the order in which they act."""

    terms: tuple[Term, ...] = ()
    given: tuple[Given, ...] = ()

    def plus(self, term: Term) -> Model:
        return replace(self, terms=tuple(sorted((*self.terms, term), key=_place)))

    def without(self, term: Term) -> Model:
        return replace(self, terms=tuple(t for t in self.terms if t != term))

    def swapped(self, term: Term, other: Term) -> Model:
        return self.without(term).plus(other)


def _place(term: Term) -> tuple[int, int]:
    return STAGES.index(term.stage), ORDER.get(term, len(ORDER))


@dataclass(frozen=True, eq=False)
class Theta:
    """Values of a model: C, the terms' parameters, a tare for each run, the rate per driver."""

    C: float
    terms: tuple[tuple[float, ...], ...]
    tares: tuple[float, ...]
    shift: float = 0.0
    """s, a nuisance: how far the clocks of force and driver may disagree unnoticed."""
    rate_shift: float = 0.0
    """s, the same between rate and driver."""
    k: float = 1.0

    @property
    def vector(self) -> Floats:
        known = (v for theta in self.terms for v in theta)
        return np.array([self.C, *known, *self.tares, self.shift, self.rate_shift, self.k])

    def with_vector(self, values: Floats) -> Theta:
        """The same lay-out with other numbers."""
        at, terms = 1, []
        for theta in self.terms:
            terms.append(tuple(map(float, values[at : at + len(theta)])))
            at += len(theta)
        tares = tuple(map(float, values[at : at + len(self.tares)]))
        return Theta(float(values[0]), tuple(terms), tares, *map(float, values[-3:]))


def acting(model: Model, theta: Theta, scale: Scale) -> list[tuple[Term, tuple[float, ...], Scale]]:
    """Every term with its values and sizes in the order in which they act; a given one before a found one."""
    found = [(term, values, scale) for term, values in zip(model.terms, theta.terms, strict=True)]
    if not model.given:
        return found
    return sorted([(g.term, g.values, g.scale) for g in model.given] + found, key=lambda each: _place(each[0]))


def remember(history: History, key: object, value: Floats) -> None:
    history.memo[key] = value
    if len(history.memo) > MOST_REMEMBERED:
        history.memo.popitem(last=False)


def predict(model: Model, theta: Theta, history: History, scale: Scale, run: int = 0) -> tuple[Floats, Floats]:
    """(F without tare, x) on the intervals of one run, each (M,).

    x is what the model itself says of the rate: a term that reads the measured rate does not count there.
    """
    value = history.driver
    modelled = None
    x = value
    stage = 0
    key: object = scale
    for term, values, sizes in acting(model, theta, scale):
        at = STAGES.index(term.stage)
        if stage < HYDRO <= at:
            x = value
            value = theta.C * x * np.abs(x)
            key = (key, theta.C)
        if stage < CELL <= at:
            key = (key, theta.tares[run])
        stage = at
        if "rotation_rate" in term.needs and modelled is None:
            modelled = value
        key = (key, term, values)
        known = history.memo.get(key)
        if known is None:
            moment = TermContext(history, sizes, theta.C, theta.tares[run], x if stage >= HYDRO else value)
            value = term.apply(value, moment, values)
            remember(history, key, value)
        else:
            history.memo.move_to_end(key)
            value = known
    if stage < HYDRO:
        x = value
        value = theta.C * x * np.abs(x)
    return value, x if modelled is None else modelled


@dataclass(frozen=True, eq=False, slots=True)
class PriorPredictionFactor:
    """Directions in which a given baseline may be off, each one standard deviation long: the prediction moves by
    columns @ z with z standard normal. Raw, per run."""

    thrust: tuple[Floats, ...]
    """(n, k) N, at all intervals with thrust."""
    rate: tuple[Floats, ...]
    """(m, k) rev/s, at all intervals with a rate; empty where the rate is no response."""


@dataclass(frozen=True, eq=False)
class Data:
    """The runs, their scales, and which rows count. `with_rate`: the measured rotation rate is a second response."""

    histories: tuple[History, ...]
    scale: Scale
    keep: tuple[NDArray[np.bool_], ...] | None = None
    """Per run (n,) of bool: thrust rows that are fitted; None for all."""
    with_rate: bool = False
    bands: tuple[tuple[float, float], ...] = ()
    """(Hz, quality) of broad peaks of the noise."""
    most_shift: float = 0.0
    """s, bound of the nuisance shift; 0 where nothing moves."""
    prior_factor: PriorPredictionFactor | None = None
    """How uncertain the baseline's own prediction is, where a twin gives it."""

    @cached_property
    def rows(self) -> tuple[NDArray[np.intp], ...]:
        """Indices of thrust rows, run by run."""
        every = tuple(h.rows for h in self.histories)
        if self.keep is None:
            return every
        return tuple(r[k] for r, k in zip(every, self.keep, strict=True))

    @cached_property
    def thrust(self) -> tuple[Floats, ...]:
        return tuple(h.thrust[r] for h, r in zip(self.histories, self.rows, strict=True))

    @cached_property
    def thrust_rows(self) -> tuple[Rows, ...]:
        return tuple(
            rows_of(h.sampled[r], h.count[r].astype(np.float64), h.spacing)
            for h, r in zip(self.histories, self.rows, strict=True)
        )

    @cached_property
    def rate_rows(self) -> tuple[Rows, ...]:
        out = []
        for h in self.histories:
            assert h.rate_count is not None
            r = h.rate_rows
            out.append(rows_of(h.middle[r], h.rate_count[r].astype(np.float64), h.rate_spacing))
        return tuple(out)

    @cached_property
    def ticks(self) -> tuple[TickRows, ...]:
        """Of the runs that have such; none where blocks of time are left out."""
        if self.keep is not None:
            return ()
        return tuple(rows for h in self.histories if (rows := h.tick_rows) is not None)

    @property
    def size(self) -> int:
        return sum(r.size for r in self.rows)


def parameters(model: Model, scale: Scale) -> tuple[tuple[Parameter, ...], ...]:
    return tuple(term.parameters(scale) for term in model.terms)


@dataclass(frozen=True, eq=False)
class Weights:
    """Whiteners of the thrust and, where it is a response, of the rate."""

    thrust: tuple[Whitener, ...]
    rate: tuple[Whitener, ...] = ()
    ticks: bool = False
    """Whether what the ticks tell has rows, after all others."""
    prior_factor: Floats | None = None
    """(n, k) whitened columns of a baseline's uncertainty, orthogonal, each as long as its variance is large."""

    def whiten(self, thrust: Sequence[Floats], rate: Sequence[Floats], ticks: Sequence[Floats] = ()) -> Floats:
        """Columns of all runs, one under the other; those of the ticks are white already."""
        parts = [w.whiten(c) for w, c in zip(self.thrust, thrust, strict=True)]
        parts += [w.whiten(c) for w, c in zip(self.rate, rate, strict=True)]
        parts += ticks
        out: Floats = np.concatenate(parts) if len(parts) > 1 else parts[0]
        if self.prior_factor is None or out.shape[0] != self.prior_factor.shape[0]:
            return out
        # noise I + A A' with A = U diag(s): its inverse root is I + U diag(1/sqrt(1 + s^2) - 1) U'
        size = np.linalg.norm(self.prior_factor, axis=0)
        U = self.prior_factor / size
        shrunk = (1 / np.sqrt(1 + size**2) - 1)[:, None] * (U.T @ out.reshape(out.shape[0], -1))
        whitened: Floats = out + (U @ shrunk).reshape(out.shape)
        return whitened

    @property
    def log_det(self) -> float:
        total = sum(w.log_det for w in (*self.thrust, *self.rate))
        if self.prior_factor is not None:
            total += float(np.sum(np.log1p(np.sum(self.prior_factor**2, axis=0))))
        return total


def weights(
    data: Data,
    noise: Noise,
    thrust_size: Sequence[Floats],
    rate_noise: Noise | None,
    rows: Sequence[Rows] | None = None,
    *,
    unit: bool = False,
) -> Weights:
    """Factor the covariances. `thrust_size`: predicted F without tare at the thrust rows, run by run. `unit`: of the
    noise alone, without the baseline's own uncertainty."""
    used = data.thrust_rows if rows is None else rows
    thrust = tuple(Whitener(noise, r, np.abs(s)) for r, s in zip(used, thrust_size, strict=True))
    rate: tuple[Whitener, ...] = ()
    if rate_noise is not None:
        rate = tuple(Whitener(rate_noise, r, np.zeros(r.time.size)) for r in data.rate_rows)
    known = Weights(thrust, rate)
    if unit:
        return known
    if data.prior_factor is None:
        return replace(known, ticks=bool(data.ticks))
    return replace(known, prior_factor=_whitened_prior(known, data, data.prior_factor))


def ticked(model: Model, theta: Theta, data: Data) -> list[Floats]:
    """What the model says of the rows of the ticks."""
    terms = acting(model, theta, data.scale)
    return [told(rows, terms, theta.C, theta.shift) for rows in data.ticks]


def _whitened_prior(known: Weights, data: Data, spread: PriorPredictionFactor) -> Floats | None:
    """Whitened, and turned into orthogonal columns."""
    thrust = spread.thrust if data.keep is None else [c[k] for c, k in zip(spread.thrust, data.keep, strict=True)]
    u, s, _ = thin_svd(known.whiten(thrust, spread.rate if known.rate else ()))
    kept = s > 1e-6
    return u[:, kept] * s[kept] if kept.any() else None


def price(term: Term, data: Data) -> int:
    """Parameters that a term adds: a delay takes the place of the small one that the clocks are allowed."""
    return len(term.parameters(data.scale)) - int(term.id == "time_skew" and data.most_shift > 0)
