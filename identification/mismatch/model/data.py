"""The runs that a model meets, and in which rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identification.mismatch.model.predictor import Predictor
from identification.mismatch.noise.covariance import Rows, rows_of
from identification.physics.term import Scale, Term
from identification.recording import Floats
from identification.run_history.history import History
from identification.run_history.remembered import RememberedRun
from identification.run_history.ticks.step_response_rows import TickRows


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
    rings: bool = False
    """Stands that ring on for periods may be sought: no line is left that one could be taken for."""
    most_shift: float = 0.0
    """s, bound of the nuisance shift; 0 where nothing moves."""
    prior_factor: PriorPredictionFactor | None = None
    """How uncertain the baseline's own prediction is, where a twin gives it, and levels that err as one."""
    twin_factor: PriorPredictionFactor | None = None
    """Of `prior_factor` what the twin gives: how large the noise is, is judged beside it."""
    constant_before: tuple[float, float] | None = None
    """C of a twin and its standard error; None without one."""
    predictor: Predictor = field(default_factory=Predictor, repr=False)
    """What predicts these runs, and remembers what it worked out; a part of them shares it."""

    @cached_property
    def runs(self) -> tuple[RememberedRun, ...]:
        return tuple(map(self.predictor.run, self.histories))

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

    def of_rows(self, thrust: Sequence[Floats]) -> list[Floats]:
        """Run by run, of what is told at all intervals with thrust (n, ...), those that are fitted."""
        if self.keep is None:
            return list(thrust)
        return [t[k] for t, k in zip(thrust, self.keep, strict=True)]

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
        return tuple(rows for run in self.runs if (rows := run.step_responses) is not None)

    @property
    def size(self) -> int:
        return sum(r.size for r in self.rows)


def hidden_by_steps(term: Term, data: Data) -> float:
    """Share of its amount, one standard deviation, that the steps of what was recorded hide of a term that needs it."""
    shares = (h.coarse.get(q, 0.0) for h in data.histories for q in term.needs)
    return max(shares, default=0.0)


def price(term: Term, data: Data) -> int:
    """Parameters that a term adds: a delay takes the place of the small one that the clocks are allowed."""
    return len(term.parameters(data.scale)) - int(bool(term.traits.delay) and data.most_shift > 0)
