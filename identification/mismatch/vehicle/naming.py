"""Terms of the final model by name: what each explains, what would do as well, why one may not be earned."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from identification.mismatch import policy
from identification.mismatch.name.named_term import Check, NamedTerm, named_term, part_check
from identification.mismatch.select.family_wise import orthogonal_basis
from identification.mismatch.select.stepwise import exchanged, stands
from identification.mismatch.vehicle.fitting import Fit, at_bound
from identification.mismatch.vehicle.model import added_forces, respond
from identification.mismatch.vehicle.motion import Motion
from identification.mismatch.vehicle.runs import Prepared
from identification.mismatch.vehicle.screening import effect_of, whitened
from identification.mismatch.vehicle.search import State, Vehicle
from identification.physics.vehicle.term import VehicleTerm
from identification.recording import Floats

Named = NamedTerm[VehicleTerm, Fit]


def name(state: State, vehicle: Vehicle) -> tuple[State, tuple[Named, ...]]:
    """Each term against its rivals; another that does better takes the place first."""
    state, known = exchanged(vehicle, state)
    standing = known or {term: stands(vehicle, state, term) for term in state.terms}
    searched = max(sum(len(term.trials(vehicle.data.scale)) for term in vehicle.terms), 1)
    return state, tuple(
        named_term(term, state.fit, stand, tuple(checks(state, vehicle.data, term)), effect_of, searched)
        for term, stand in standing.items()
    )


def checks(state: State, data: Prepared, term: VehicleTerm) -> Iterator[Check]:
    """Whether its values are possible, and a parameter the same in parts of the recordings."""
    fitted, ended = state.fit, at_bound(state.fit, term)
    yield Check("possible", "its values are possible", "it would take values that are not possible" if ended else "")
    layout, i = fitted.layout, fitted.layout.of(term).start
    amount = fitted.theta[i] - (layout.parts[term][0].neutral or 0.0)
    if len(layout.parts[term]) > 1 or amount == 0 or not fitted.free[i]:
        return
    base = orthogonal_basis(fitted.jacobian)
    effects = [
        amount * added_forces(layout, fitted.theta, data, j, fitted.motions[j])[:, i] for j in range(len(data.runs))
    ]
    splits = _splits(fitted.motions, data)
    for what, masks in splits.items():
        columns = [
            respond(layout, fitted.theta, data, j, fitted.motions[j], (effects[j] * masks[j])[:, None])[:, :-2]
            for j in range(len(data.runs))
        ]
        column = whitened(state.white, columns, fitted.residual.size)[:, 0]
        yield part_check(what, column, base, fitted.residual, policy.vehicle.VEHICLE_PART_DIFFERENCE, len(splits))


def _splits(motions: Sequence[Motion], data: Prepared) -> dict[str, list[Floats]]:
    """Two parts of all that was recorded, several times."""
    halves = [(np.arange(run.steps) < run.steps // 2).astype(np.float64) for run in data.runs]
    ahead = [(0.5 * (m.v[1:] + m.v[:-1]) > 0).astype(np.float64) for m in motions]
    out = {"in the first and the second half of the runs": halves}
    share = float(np.mean(np.concatenate(ahead)))
    if policy.vehicle.AHEAD_ASTERN_SHARE < share < 1 - policy.vehicle.AHEAD_ASTERN_SHARE:
        out["ahead and astern"] = ahead
    if len(data.runs) > 1:
        out["in every second run"] = [np.full(run.steps, float(j % 2)) for j, run in enumerate(data.runs)]
    return out
