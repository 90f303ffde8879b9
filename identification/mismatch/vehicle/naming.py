"""Terms of the final model by name: what each explains, what would do as well, why one may not be earned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.estimation.tails import chi2_sf
from identification.mismatch import policy
from identification.mismatch.model.whitening import Weights
from identification.mismatch.name.naming import difference, probability_beside
from identification.mismatch.select.family_wise import orthogonal_basis
from identification.mismatch.vehicle.fitting import Fit, at_bound
from identification.mismatch.vehicle.model import added_forces, respond
from identification.mismatch.vehicle.motion import Motion
from identification.mismatch.vehicle.runs import Prepared
from identification.mismatch.vehicle.screening import screen, trials, whitened
from identification.mismatch.vehicle.search import FITTED, State, bic, dropped, fitted_with
from identification.physics.vehicle.term import VehicleTerm
from identification.recording import Floats

SWAPS = 2
"""Rounds in which a term gives way to a better rival: more would go in circles."""


@dataclass(frozen=True, eq=False)
class Rival:
    """Another term in the place of one, everything fitted anew."""

    term: VehicleTerm
    fit: Fit
    bic_loss: float


@dataclass(frozen=True, eq=False)
class Named:
    term: VehicleTerm
    chi2_gain: float
    """Chi-square that is lost without it."""
    p_value: float
    bic_gain: float
    rivals: tuple[Rival, ...]
    probability: float
    failed_checks: tuple[str, ...]
    """Why the name is not earned; empty when it is."""


def name(
    state: State, data: Prepared, candidates: Sequence[VehicleTerm], rng: np.random.Generator
) -> tuple[State, tuple[Named, ...]]:
    """Each term against its rivals; another that does better takes the place first."""
    named = _all_named(state, data, candidates, rng)
    for _ in range(SWAPS):
        better = [r for n in named for r in n.rivals if r.bic_loss < -policy.select.RIVAL_BETTER_BIC]
        if not better:
            break
        state = State(min(better, key=lambda r: r.bic_loss).fit, state.noise, state.white)
        named = _all_named(state, data, candidates, rng)
    return state, named


def _all_named(
    state: State, data: Prepared, candidates: Sequence[VehicleTerm], rng: np.random.Generator
) -> tuple[Named, ...]:
    return tuple(_named(state, data, candidates, i, rng) for i in range(len(state.terms)))


def _named(state: State, data: Prepared, candidates: Sequence[VehicleTerm], i: int, rng: np.random.Generator) -> Named:
    term = state.terms[i]
    less = dropped(state, data, i)
    gain = less.chi2 - state.fit.chi2
    count = len(state.fit.layout.parts[i])
    rivals = _rivals(state, less, data, candidates, term, rng)
    near = tuple(r for r in rivals if r.bic_loss < policy.select.RIVAL_STATED_BIC)
    failed = ["its parameters end at what is physically possible"] if at_bound(state.fit, i) else []
    failed += inconstancies(state.fit, state.white, data, i)
    kept = tuple(r for r in near if _key(r.term) != _key(term) or r.bic_loss < -policy.select.RIVAL_BETTER_BIC)
    p = max(float(chi2_sf(gain, count)), 1e-300)
    probability = probability_beside([r.bic_loss for r in near])
    return Named(term, gain, p, bic(less) - state.bic(), kept, probability, tuple(failed))


def _rivals(
    state: State,
    less: Fit,
    data: Prepared,
    candidates: Sequence[VehicleTerm],
    term: VehicleTerm,
    rng: np.random.Generator,
) -> list[Rival]:
    """Every other term that could take most of what this one explains."""
    there = [t for t in state.terms if t is not term]
    others = [t for t in candidates if t is not term and all(_key(t) != _key(u) for u in there)]
    ranked, _ = screen(less, state.white, trials(less, data, others), rng)
    out = []
    for screened in ranked[: FITTED + 1]:
        if (
            less.chi2 - screened.gain
            > state.fit.chi2 + 0.5 * (less.chi2 - state.fit.chi2) + policy.select.RIVAL_STATED_BIC
        ):
            continue
        other = fitted_with(less, state.white, data, screened)
        if at_bound(other, len(other.layout.parts) - 1):
            continue
        out.append(Rival(screened.trial.term, other, bic(other) - state.bic()))
    return sorted(out, key=lambda r: r.bic_loss)


def _key(term: VehicleTerm) -> tuple[str, str]:
    return term.id, getattr(term, "name", "")


def inconstancies(fitted: Fit, white: Weights, data: Prepared, term: int) -> list[str]:
    """Parts of the recordings in which a term's amount differs by more than chance and VEHICLE_PART_DIFFERENCE."""
    layout, i = fitted.layout, fitted.layout.first_of[term]
    amount = fitted.theta[i] - (layout.parts[term][0].neutral or 0.0)
    if len(layout.parts[term]) > 1 or amount == 0 or not fitted.free[i]:
        return []
    base = orthogonal_basis(fitted.jacobian)
    effects = [
        amount * added_forces(layout, fitted.theta, data, j, fitted.motions[j])[:, i] for j in range(len(data.runs))
    ]
    out = []
    splits = _splits(fitted.motions, data)
    for name, masks in splits.items():
        columns = [
            respond(layout, fitted.theta, data, j, fitted.motions[j], (effects[j] * masks[j])[:, None])[:, :-2]
            for j in range(len(data.runs))
        ]
        column = whitened(white, columns, fitted.residual.size)[:, 0]
        apart = difference(column, base, fitted.residual, policy.vehicle.VEHICLE_PART_DIFFERENCE, len(splits))
        if apart is not None:
            out.append(f"its parameter is not the same {name} ({100 * apart:.0f} % apart)")
    return out


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
