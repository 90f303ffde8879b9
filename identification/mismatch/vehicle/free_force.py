"""A force of any shape over one covariate: what stands in the model for physics that no term carries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from identification.mismatch.vehicle.fitting import Fit, fit
from identification.mismatch.vehicle.left import Covariate, Structure, covariates
from identification.mismatch.vehicle.model import Layout, VehicleModel, layout_of, with_term
from identification.mismatch.vehicle.runs import Prepared
from identification.mismatch.vehicle.search import State, refreshed
from identification.physics.term import Parameter
from identification.physics.vehicle.term import Body, Scale, Stage, Untouched, VehicleContext
from identification.recording import Floats

MOST = 5.0
"""Of the largest force: bound of a free force at a knot, beyond anything that acts."""
LOCAL = ("time", "run")
"""Coordinates that say nothing of other runs."""


@dataclass(frozen=True, eq=False, slots=True)
class FreeForce(Untouched):
    """N at the knots, straight lines between."""

    id: ClassVar[str] = "free_force"
    stage: ClassVar[Stage] = "body"
    physics: ClassVar[str] = "a force that no effect of the catalogue carries"
    form: ClassVar[str] = ""
    covariate: Covariate
    bumps: Mapping[str, Floats]
    """run -> (g, b), or (g, b - 1) with a reference"""
    reference: int | None = None
    """Knot at which the force is 0: beside a steady force of another term the two would be one. None: there is none."""

    @property
    def knots(self) -> Floats:
        """Those with a parameter."""
        at = self.covariate.knots
        return at if self.reference is None else np.delete(at, self.reference)

    @property
    def covariates(self) -> tuple[str, ...]:
        return (self.covariate.quantity,)

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        most = MOST * scale.force
        return tuple(Parameter(f"at[{knot:.3g}]", scale.force_unit, -most, most, 0.0) for knot in self.knots)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.01 * scale.force,) * self.knots.size,)

    def on_body(self, body: Body, now: VehicleContext, theta: tuple[float, ...]) -> Body:
        bumps = self.bumps.get(now.run)
        return body if bumps is None else replace(body, steady=body.steady + bumps @ theta)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        most = max(map(abs, theta))
        over_what = self.covariate.quantity.replace("_", " ")
        return (
            f"A force over {over_what}, up to {most:.3g} {scale.force_unit}, that no effect of the catalogue carries."
        )


def over(covariate: Covariate, data: Prepared, reference: int | None = None) -> FreeForce:
    """A free force over a covariate of these runs."""
    bumps = {run.recording_id: covariate.bumps(j) for j, run in enumerate(data.runs)}
    if reference is not None:
        bumps = {name: np.delete(one, reference, axis=1) for name, one in bumps.items()}
    return FreeForce(covariate, bumps, reference)


def with_free_force(state: State, data: Prepared, structure: Structure) -> State:
    """The model with a free force over the covariate that is clearest, everything fitted anew."""
    steady = any(term.id == "buoyancy_offset" for term in state.terms)
    term = over(structure.covariate, data, structure.covariate.knots.size // 2 if steady else None)
    zeros = [0.0] * term.knots.size
    layout, theta = with_term(state.fit.layout, data, state.fit.theta, term, zeros)
    return refreshed(fit(layout, theta, data, state.white, state.fit.motions), data, ())


def free_index(layout: Layout) -> int | None:
    """Which term is a free force."""
    return next((i for i, term in enumerate(layout.model.terms) if isinstance(term, FreeForce)), None)


def carried(layout: Layout, index: int, bare: Fit, unseen: Prepared) -> Layout:
    """The same model for other runs, whose covariate is taken from `bare`: their motion without the free force."""
    terms = list(layout.model.terms)
    term = terms[index]
    if not isinstance(term, FreeForce):
        raise TypeError(f"term {index} is {term.id}, not a free force")
    there = next((c for c in covariates(bare, unseen) if c.quantity == term.covariate.quantity), None)
    known = there is not None and there.quantity not in LOCAL
    terms[index] = (
        over(replace(there, knots=term.covariate.knots), unseen, term.reference)
        if known and there
        else replace(term, bumps={})
    )
    return layout_of(VehicleModel(tuple(terms)), unseen)
