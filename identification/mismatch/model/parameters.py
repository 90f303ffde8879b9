"""The values of a model, by name: what stands where in the vector that a fit moves is known here and nowhere else."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identification.physics.term import Scale, Term
from identification.recording import Floats


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

    def with_part(self, which: NDArray[np.bool_], part: Floats) -> Theta:
        """The same with `part` (p,) in the place of those `which` (q,) of the vector."""
        vector = self.vector.copy()
        vector[which] = part
        return self.with_vector(vector)

    def with_vector(self, values: Floats) -> Theta:
        """The same lay-out with other numbers."""
        C, *rest = values.tolist()
        terms, at = [], 0
        for known in self.terms:
            terms.append(tuple(rest[at : at + len(known)]))
            at += len(known)
        return Theta(C, tuple(terms), tuple(rest[at : at + len(self.tares)]), *rest[at + len(self.tares) :])


@dataclass(frozen=True)
class Layout:
    """Where each value stands in `Theta.vector`: C, the parameters of each term, a tare a run, two shifts, k."""

    terms: tuple[Term, ...]
    counts: tuple[int, ...]
    """Parameters of each term."""
    runs: int

    @property
    def C(self) -> int:
        return 0

    @cached_property
    def _begins(self) -> dict[Term, int]:
        starts = np.cumsum([1, *self.counts]).tolist()
        return dict(zip(self.terms, starts, strict=False))

    def of(self, term: Term) -> slice:
        """The parameters of a term. Raises KeyError where the model has it not."""
        begin = self._begins[term]
        return slice(begin, begin + self.counts[self.terms.index(term)])

    def parameter(self, term: Term, name: str, scale: Scale) -> int:
        """One parameter of a term by its name. Raises KeyError, ValueError."""
        return self._begins[term] + [p.name for p in term.parameters(scale)].index(name)

    @property
    def _first_tare(self) -> int:
        return 1 + sum(self.counts)

    @property
    def of_terms(self) -> slice:
        """The parameters of all terms."""
        return slice(1, self._first_tare)

    @property
    def tares(self) -> slice:
        return slice(self._first_tare, self.shift)

    def tare(self, run: int) -> int:
        return self._first_tare + run

    def run_of(self, index: int) -> int | None:
        """Whose tare stands at an index; None where it is no tare."""
        return index - self._first_tare if self._first_tare <= index < self.shift else None

    @property
    def shift(self) -> int:
        return self._first_tare + self.runs

    @property
    def rate_shift(self) -> int:
        return self.shift + 1

    @property
    def k(self) -> int:
        return self.shift + 2

    @property
    def size(self) -> int:
        return self.shift + 3

    def shared(self, other: Layout) -> dict[int, int]:
        """Index here to index there, of every value that both have; of models of the same runs."""
        out = {self.C: other.C, self.shift: other.shift, self.rate_shift: other.rate_shift, self.k: other.k}
        both = [(self.of(term), other.of(term)) for term in self.terms if term in other.terms]
        for here, there in [(self.tares, other.tares), *both]:
            out |= dict(zip(range(here.start, here.stop), range(there.start, there.stop), strict=True))
        return out
