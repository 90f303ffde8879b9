"""A model: C x|x| with terms, one tare a run; its prediction, and the rows in which it meets the measurements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identification.mismatch.noise import Noise, Rows, Whitener
from identification.physics.catalogue import CATALOGUE
from identification.physics.history import History
from identification.physics.term import STAGES, Moment, Parameter, Scale, Term
from identification.recording import Floats

ORDER = {term: i for i, term in enumerate(sorted(CATALOGUE, key=lambda t: STAGES.index(t.stage)))}
"""Stage by stage, and in the order of the catalogue within one."""


@dataclass(frozen=True)
class Model:
    """Terms in the order in which they act."""

    terms: tuple[Term, ...] = ()

    def plus(self, term: Term) -> Model:
        return Model(tuple(sorted((*self.terms, term), key=_place)))

    def without(self, term: Term) -> Model:
        return Model(tuple(t for t in self.terms if t != term))

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
    k: float = 1.0

    @property
    def vector(self) -> Floats:
        return np.array([self.C, *(v for theta in self.terms for v in theta), *self.tares, self.shift, self.k])

    def with_vector(self, values: Floats) -> Theta:
        """The same lay-out with other numbers."""
        at, terms = 1, []
        for theta in self.terms:
            terms.append(tuple(map(float, values[at : at + len(theta)])))
            at += len(theta)
        tares = tuple(map(float, values[at : at + len(self.tares)]))
        return Theta(float(values[0]), tuple(terms), tares, float(values[-2]), float(values[-1]))


def predict(model: Model, theta: Theta, history: History, scale: Scale) -> tuple[Floats, Floats]:
    """(F without tare, x) on the intervals of one run, each (M,)."""
    value = history.driver
    x = value
    stage = 0
    for term, values in zip(model.terms, theta.terms, strict=True):
        at = STAGES.index(term.stage)
        if stage < STAGES.index("hydro") <= at:
            x = value
            value = theta.C * x * np.abs(x)
        stage = at
        value = term.apply(value, Moment(history, scale, theta.C, x if stage > 1 else value), values)
    if stage < STAGES.index("hydro"):
        x = value
        value = theta.C * x * np.abs(x)
    return value, x


@dataclass(frozen=True, eq=False)
class Data:
    """The runs, their scales, and which rows count. `with_rate`: the measured rotation rate is a second response."""

    histories: tuple[History, ...]
    scale: Scale
    keep: tuple[Floats, ...] | None = None
    """Per run (n,) of bool: thrust rows that are fitted; None for all."""
    with_rate: bool = False
    most_shift: float = 0.0
    """s, bound of the nuisance shift; 0 where nothing moves."""

    @cached_property
    def rows(self) -> tuple[Floats, ...]:
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
            Rows(h.sampled[r], h.count[r].astype(np.float64), np.ones(r.size))
            for h, r in zip(self.histories, self.rows, strict=True)
        )

    @cached_property
    def rate_rows(self) -> tuple[Rows, ...]:
        out = []
        for h in self.histories:
            assert h.rate_count is not None
            r = h.rate_rows
            out.append(Rows(h.middle[r], h.rate_count[r].astype(np.float64), np.ones(r.size)))
        return tuple(out)

    @property
    def size(self) -> int:
        return sum(r.size for r in self.rows)


def scale_of(histories: Sequence[History], C: float) -> Scale:
    """Sizes of these runs; C from a first fit."""
    driver = max(h.size for h in histories)
    unit = "rev/s" if histories[0].driver_quantity == "rotation_rate" else "V"
    flows = [float(np.max(np.abs(h.others["flow_speed"]))) for h in histories if "flow_speed" in h.others]
    return Scale(
        driver=driver,
        driver_unit=unit,
        thrust=abs(C) * driver**2,
        duration=max(float(h.edges[-1] - h.edges[0]) for h in histories),
        interval=float(min(np.median(np.sort(h.dt)[: max(h.dt.size // 4, 1)]) for h in histories)),
        flow=max(flows, default=0.0),
    )


def parameters(model: Model, scale: Scale) -> tuple[tuple[Parameter, ...], ...]:
    return tuple(term.parameters(scale) for term in model.terms)


@dataclass(frozen=True, eq=False)
class Weights:
    """Whiteners of the thrust and, where it is a response, of the rate."""

    thrust: tuple[Whitener, ...]
    rate: tuple[Whitener, ...] = ()

    def whiten(self, thrust: Sequence[Floats], rate: Sequence[Floats]) -> Floats:
        """Columns of all runs, one under the other."""
        parts = [w.whiten(c) for w, c in zip(self.thrust, thrust, strict=True)]
        parts += [w.whiten(c) for w, c in zip(self.rate, rate, strict=True)]
        return np.concatenate(parts)


def weights(
    data: Data,
    noise: Noise,
    thrust_size: Sequence[Floats],
    rate_noise: Noise | None,
    rows: Sequence[Rows] | None = None,
) -> Weights:
    """Factor the covariances. `thrust_size`: predicted F without tare at the thrust rows, run by run."""
    used = data.thrust_rows if rows is None else rows
    thrust = tuple(Whitener(noise, r, np.abs(s)) for r, s in zip(used, thrust_size, strict=True))
    rate: tuple[Whitener, ...] = ()
    if rate_noise is not None:
        rate = tuple(Whitener(rate_noise, r, np.zeros(r.time.size)) for r in data.rate_rows)
    return Weights(thrust, rate)
