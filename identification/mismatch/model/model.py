"""A model: C x|x| with terms, in the order in which they act, and one tare a run."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

from identification.mismatch.model.parameters import Layout, Theta
from identification.physics.catalogue import CATALOGUE
from identification.physics.term import STAGES, Parameter, Scale, Term

PLACES = {(term.id, term.form): i for i, term in enumerate(sorted(CATALOGUE, key=lambda t: STAGES.index(t.stage)))}
"""Stage by stage, and in the order of the catalogue within one; of effects and forms: a threshold that is known is
sharper than that of the catalogue, and acts where it does."""
Acting = tuple[Term, tuple[float, ...], Scale]
"""A term with its values, and the sizes that they refer to."""


def usual_form(term: Term, other: Term, scale: Scale) -> bool:
    """Whether the two are forms of one effect with as many parameters, and `term` is the first that textbooks have."""
    alike = term.id == other.id and len(term.parameters(scale)) == len(other.parameters(scale))
    return alike and PLACES[term.id, term.form] < PLACES[other.id, other.form]


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

    @cached_property
    def held(self) -> tuple[Given, ...]:
        """Of the baseline, what acts: a term that is fitted anew takes the place of the one given."""
        return tuple(g for g in self.given if not any(self.given_for(t) is g for t in self.terms))

    @cached_property
    def order(self) -> tuple[int, ...]:
        """In which `held` and `terms`, one after the other, act."""
        every = [*(g.term for g in self.held), *self.terms]
        return tuple(sorted(range(len(every)), key=lambda i: _place(every[i])))

    def given_for(self, term: Term) -> Given | None:
        """What the baseline has of the same effect in the same textbook form, once: `term` is then a change of it."""
        if not self.given or (term.id, term.form) not in PLACES:
            return None
        known = [g for g in self.given if (g.term.id, g.term.form) == (term.id, term.form)]
        return known[0] if len(known) == 1 else None

    def plus(self, term: Term) -> Model:
        return replace(self, terms=tuple(sorted((*self.terms, term), key=_place)))

    def without(self, term: Term) -> Model:
        return replace(self, terms=tuple(t for t in self.terms if t != term))

    def swapped(self, term: Term, other: Term) -> Model:
        return self.without(term).plus(other)

    def layout(self, theta: Theta) -> Layout:
        """Where its values stand in the vector of `theta`."""
        return Layout(self.terms, tuple(map(len, theta.terms)), len(theta.tares))

    def values(self, theta: Theta) -> dict[Term, tuple[float, ...]]:
        """The values of each term."""
        return dict(zip(self.terms, theta.terms, strict=True))


def _place(term: Term) -> tuple[int, int]:
    return STAGES.index(term.stage), PLACES.get((term.id, term.form), len(PLACES))


def acting(model: Model, theta: Theta, scale: Scale) -> list[Acting]:
    """Every term with its values and sizes in the order in which they act; a given one before a found one."""
    found = [(term, values, scale) for term, values in zip(model.terms, theta.terms, strict=True)]
    if not model.given:
        return found
    every = [*((g.term, g.values, g.scale) for g in model.held), *found]
    return [every[i] for i in model.order]


def reduced(model: Model, theta: Theta, without: Collection[Term]) -> tuple[Model, Theta]:
    """The rest of a model, its values as they were."""
    kept = tuple(t for t in model.terms if t not in without)
    known = model.values(theta)
    return replace(model, terms=kept), replace(theta, terms=tuple(known[t] for t in kept))


def extended(model: Model, theta: Theta, term: Term, values: tuple[float, ...]) -> tuple[Model, Theta]:
    """A model with one term more, which begins at `values`."""
    bigger, known = model.plus(term), {**model.values(theta), term: values}
    return bigger, replace(theta, terms=tuple(known[t] for t in bigger.terms))


def with_values(model: Model, theta: Theta, term: Term, values: tuple[float, ...]) -> Theta:
    """The same with other values of one term."""
    known = {**model.values(theta), term: values}
    return replace(theta, terms=tuple(known[t] for t in model.terms))


def parameters(model: Model, scale: Scale) -> tuple[tuple[Parameter, ...], ...]:
    """The parameters of each term of a model, in the order of `model.terms`."""
    return tuple(term.parameters(scale) for term in model.terms)
