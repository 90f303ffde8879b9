"""The stage: the selected model in, what it leaves over every covariate out, with the noise that shows it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.locate.residual_structure_test import ResidualStructure, residual_structure
from identification.mismatch.locate.slow_change import beside_slow_change
from identification.mismatch.locate.unrest import beside_unrest
from identification.mismatch.model.data import Data
from identification.mismatch.model.whitening import Weights
from identification.mismatch.noise.whiteness import whiteness
from identification.mismatch.select.forward_selection import Selected, Thruster
from identification.mismatch.select.shape_error import corrections


@dataclass(frozen=True, eq=False, slots=True)
class Located:
    """What the selected model leaves."""

    estimate: Estimate
    """The model with the noise by which that was judged: beside a slow change, where there is one."""
    left: ResidualStructure

    @property
    def structured(self) -> bool:
        """Whether more than noise is left."""
        return self.left.p_value < policy.locate.RESIDUAL_FALSE_ALARM


def calmed(selected: Selected, rng: np.random.Generator) -> Selected:
    """Without what was added to the baseline, where beside noise after steps that leaves nothing at all, nor any term
    of the catalogue anything to take."""
    data, before = selected.data, selected.before
    if len(selected.after.fit.model.terms) == len(before.fit.model.terms):
        return selected
    unquiet = beside_unrest(before, data)
    if unquiet is None:
        return selected
    judged = Thruster(data, selected.terms).judged(unquiet, rng)
    left = residual_structure(unquiet.fit, data, unquiet.weights, rng)
    if judged.largest > judged.threshold or left.p_value < policy.locate.RESIDUAL_FALSE_ALARM:
        return selected
    return replace(selected, after=before, last=judged, standing=None)


def run(selected: Selected, rng: np.random.Generator) -> Located:
    """Structure over any covariate; else what the last screening could not carry; else a slow change."""
    data, after = selected.data, selected.after
    left = _with_colour(residual_structure(after.fit, data, after.weights, rng), after, data)
    if left.p_value < policy.locate.RESIDUAL_FALSE_ALARM and (calm := _unrest(after, data, rng)):
        return calm
    if left.p_value < policy.locate.RESIDUAL_FALSE_ALARM or not left.groups:
        return Located(after, left)
    last = selected.last
    if last is not None and last.largest > max(last.threshold, policy.locate.UNCARRIED_SIGMA):
        best = last.directions.terms[int(np.argmax(last.z))]
        worse = replace(left, p_value=min(last.p_value, left.p_value))
        return Located(after, _foremost_over(worse, best.covariates))
    beside = beside_slow_change(after, data)
    if beside is None:
        return Located(after, left)
    return Located(beside, _foremost_over(residual_structure(beside.fit, data, beside.weights, rng), ("time",)))


def _unrest(after: Estimate, data: Data, rng: np.random.Generator) -> Located | None:
    """The same with nothing left, where all that seemed to be is noise after steps."""
    unquiet = beside_unrest(after, data)
    if unquiet is None:
        return None
    calm = Located(after, residual_structure(unquiet.fit, data, unquiet.weights, rng))
    return None if calm.structured else calm


def _foremost_over(left: ResidualStructure, quantities: Collection[str]) -> ResidualStructure:
    """The same with these covariates first."""
    return replace(left, groups=tuple(sorted(left.groups, key=lambda g: g.covariate.quantity not in quantities)))


def _with_colour(left: ResidualStructure, after: Estimate, data: Data) -> ResidualStructure:
    """What is left counts as structure too when it is far from white, and more than the terms' shapes may leave."""
    colour = whiteness(after.fit.residual, [r.size for r in data.rows])
    if (
        not after.fit.model.terms
        or colour > policy.locate.COLOURED_RESIDUAL_P
        or left.p_value < policy.locate.RESIDUAL_FALSE_ALARM
    ):
        return left
    changes = corrections(after.fit, data, Weights(after.weights.thrust))
    spared = policy.select.SHAPE_ERROR**2 * float(sum(change @ change for change in changes))
    excess = float(after.fit.residual[: data.size] @ after.fit.residual[: data.size]) - data.size
    return replace(left, p_value=colour) if excess > spared else left
