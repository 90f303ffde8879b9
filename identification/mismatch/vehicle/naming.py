"""Terms of the final model by name: what each explains, what would do as well, why one may not be earned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2 as chi2_law

from identification.mismatch import policy
from identification.mismatch.vehicle.fitting import Fit
from identification.mismatch.vehicle.left import inconstancies
from identification.mismatch.vehicle.runs import Prepared
from identification.mismatch.vehicle.screening import screen, trials
from identification.mismatch.vehicle.search import FITTED, State, bic, dropped, fitted_with
from identification.physics.vehicle.term import VehicleTerm

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
    index: int
    """Of the term in the model."""
    term: VehicleTerm
    gain: float
    """Chi-square that is lost without it."""
    p_value: float
    bic_gain: float
    rivals: tuple[Rival, ...]
    probability: float
    doubts: tuple[str, ...]


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
    probability = 1 / (1 + sum(float(np.exp(-0.5 * r.bic_loss)) for r in near))
    doubts = (*_edges(state.fit, i), *inconstancies(state.fit, state.white, data, i))
    kept = tuple(r for r in near if _key(r.term) != _key(term) or r.bic_loss < -policy.select.RIVAL_BETTER_BIC)
    p = max(float(chi2_law.sf(gain, count)), 1e-300)
    return Named(i, term, gain, p, bic(less) - state.bic(), kept, probability, doubts)


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
        out.append(Rival(screened.trial.term, other, bic(other) - state.bic()))
    return sorted(out, key=lambda r: r.bic_loss)


def _key(term: VehicleTerm) -> tuple[str, str]:
    return term.id, getattr(term, "name", "")


def _edges(fitted: Fit, i: int) -> list[str]:
    """Parameters that the data press against the limit of what is possible."""
    begin = fitted.layout.first_of[i]
    out = []
    for k, p in enumerate(fitted.layout.parts[i]):
        value = fitted.theta[begin + k]
        span = p.high - p.low
        if min(value - p.low, p.high - value) <= policy.vehicle.EDGE_OF_POSSIBLE * span and p.neutral != value:
            out.append(f"its {p.name} of {value:.3g} {p.unit} is at the edge of what is possible")
    return out
