"""Terms are added one at a time, each with everything fitted anew, and dropped when they no longer earn their place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.estimation.tails import chi2_sf
from identification.mismatch import policy
from identification.mismatch.model.whitening import Weights
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.select.stepwise import least_earned, preferred
from identification.mismatch.vehicle.fitting import Fit, at_bound, fit, noise_of, weights
from identification.mismatch.vehicle.model import Layout, VehicleModel, begin, layout_of, with_term, without_term
from identification.mismatch.vehicle.runs import Prepared
from identification.mismatch.vehicle.screening import Screened, screen, trials
from identification.physics.vehicle.term import VehicleTerm
from identification.recording import Floats

FITTED = 4
"""Candidates of a round that are fitted: each costs a simulation for every slope."""
LIGHT = 0.1
"""Of the mass that a first guess takes."""
QUICK = 10
"""Steps of a candidate's fit."""


@dataclass(frozen=True, eq=False)
class State:
    """A model, fitted, with the noise that weighs it."""

    fit: Fit
    noise: Noise
    white: Weights

    @property
    def terms(self) -> tuple[VehicleTerm, ...]:
        return self.fit.layout.model.terms

    def bic(self) -> float:
        """Chi-square and what its parameters cost; to be compared under one noise."""
        return bic(self.fit)


def bic(fitted: Fit) -> float:
    """Chi-square plus ln N for each parameter of a term."""
    number = sum(map(len, fitted.layout.parts))
    return fitted.chi2 + number * float(np.log(fitted.residual.size))


@dataclass(frozen=True, eq=False)
class Found:
    before: State
    after: State
    candidates: tuple[VehicleTerm, ...]


def search(data: Prepared, candidates: Sequence[VehicleTerm], rng: np.random.Generator) -> Found:
    """The baseline, and the model that nothing in the catalogue improves any more."""
    state = _baseline(data, candidates)
    first, seen = state, {frozenset(state.terms)}
    while len(state.terms) < policy.vehicle.VEHICLE_MODEL_TERMS:
        left = [term for term in candidates if _new(term, state.terms)]
        best = _best(state, data, left, rng)
        if best is None:
            break
        larger = pruned(refreshed(best, data, left), data)
        if frozenset(larger.terms) in seen:
            break
        state = larger
        seen.add(frozenset(state.terms))
    return Found(_under(first, state, data), state, tuple(candidates))


def _new(term: VehicleTerm, there: Sequence[VehicleTerm]) -> bool:
    """Not in the model, nor another form of what is; efficiencies of other groups of thrusters are new."""
    name = getattr(term, "name", "")
    return all(t.id != term.id or getattr(t, "name", "") != name for t in there)


def _baseline(data: Prepared, candidates: Sequence[VehicleTerm]) -> State:
    layout = layout_of(VehicleModel(), data)
    spread = np.concatenate([np.diff(run.response, 2) for run in data.runs])
    white = float(np.median(np.abs(spread)) / 0.6745) ** 2 / 6 or 1e-6 * float(np.var(data.runs[0].response))
    noise = Noise(white, 0.0)
    rough = min((fit(layout, start, data, weights(noise, data)) for start in _starts(layout, data)), key=_chi2)
    noise = noise_of(rough, data, _columns(rough, data, candidates))
    white_of = weights(noise, data)
    return State(fit(layout, rough.theta, data, white_of, rough.motions), noise, white_of)


def _chi2(fitted: Fit) -> float:
    return fitted.chi2


def _starts(layout: Layout, data: Prepared) -> list[Floats]:
    """A heavy vehicle and a light one, where the mass is not stated."""
    heavy = begin(layout, data)
    names = [p.name for p in layout.base]
    if "m" not in names or data.mass is not None:
        return [heavy]
    light = heavy.copy()
    light[names.index("m")] *= LIGHT
    return [heavy, light]


def _columns(fitted: Fit, data: Prepared, terms: Sequence[VehicleTerm]) -> list[Floats]:
    """What the catalogue could change: the noise must not hold it."""
    found = trials(fitted, data, terms, most=1)
    return [
        np.hstack([one.columns[j] for one in found]) if found else np.empty((run.time.size, 0))
        for j, run in enumerate(data.runs)
    ]


def _best(state: State, data: Prepared, terms: Sequence[VehicleTerm], rng: np.random.Generator) -> Fit | None:
    """The best model with one term more, when it passes the family-wise threshold and its BIC is better."""
    ranked, needed = screen(state.fit, state.white, trials(state.fit, data, terms), rng)
    found = [fitted_with(state.fit, state.white, data, s) for s in promising(ranked)]
    good = [one for one in found if chi2_sf(state.fit.chi2 - one.chi2, _more(state, one)) < needed]
    good = [one for one in good if bic(one) < state.bic()]
    if not good:
        return None
    at = len(state.terms)
    gains, pressed = [state.bic() - bic(one) for one in good], [at_bound(one, at) for one in good]
    return good[preferred(gains, [_more(state, one) for one in good], pressed)]


def promising(ranked: Sequence[Screened]) -> list[Screened]:
    """Those that promise most."""
    most = max((s.gain for s in ranked), default=0.0)
    return [s for s in ranked if s.gain >= policy.vehicle.VEHICLE_CANDIDATE_GAIN * most][:FITTED]


def _more(state: State, other: Fit) -> int:
    return max(other.layout.starts - state.fit.layout.starts, 1)


def fitted_with(now: Fit, white: Weights, data: Prepared, screened: Screened, steps: int = QUICK) -> Fit:
    """The model with a screened term, everything fitted anew from the amount that screened best."""
    term, values = screened.trial.term, screened.trial.values
    layout, theta = with_term(now.layout, data, now.theta, term, values)
    return fit(layout, theta, data, white, now.motions, steps=steps)


def refreshed(better: Fit, data: Prepared, left: Sequence[VehicleTerm]) -> State:
    """The same model under the noise of its own residual."""
    terms = [term for term in left if _new(term, better.layout.model.terms)]
    noise = noise_of(better, data, _columns(better, data, terms))
    white = weights(noise, data)
    return State(fit(better.layout, better.theta, data, white, better.motions), noise, white)


def pruned(state: State, data: Prepared) -> State:
    """Without terms that no longer earn their place, worst first."""
    while state.terms:
        less = [dropped(state, data, i) for i in range(len(state.terms))]
        worst = least_earned([one.chi2 - state.fit.chi2 for one in less], [*map(len, state.fit.layout.parts)])
        if worst is None:
            return state
        state = State(less[worst], state.noise, state.white)
    return state


def less(state: State, data: Prepared, terms: Sequence[VehicleTerm]) -> State:
    """The model without these, everything else fitted anew."""
    for term in terms:
        state = State(dropped(state, data, state.terms.index(term)), state.noise, state.white)
    return state


def dropped(state: State, data: Prepared, i: int, steps: int = QUICK) -> Fit:
    """Everything but term i, fitted anew."""
    layout, theta = without_term(state.fit.layout, data, state.fit.theta, i)
    return fit(layout, theta, data, state.white, state.fit.motions, steps=steps)


def _under(first: State, last: State, data: Prepared) -> State:
    """The baseline weighed by the noise of the final model."""
    if last is first:
        return first
    return State(fit(first.fit.layout, first.fit.theta, data, last.white, first.fit.motions), last.noise, last.white)
