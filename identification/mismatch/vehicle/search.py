"""Terms are added one at a time, each with everything fitted anew, and dropped when they no longer earn their place."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.estimation.tails import chi2_sf
from identification.mismatch import policy
from identification.mismatch.model.whitening import Weights
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.select.rounds import Candidate
from identification.mismatch.select.stepwise import RivalTerm, Standing, forward
from identification.mismatch.vehicle.fitting import Fit, at_bound, fit, noise_of, weights
from identification.mismatch.vehicle.model import Layout, VehicleModel, begin, layout_of, with_term, without_term
from identification.mismatch.vehicle.runs import Prepared
from identification.mismatch.vehicle.screening import Screened, best_of_each, effect_of, explained, needed, trials
from identification.physics.vehicle.term import VehicleTerm
from identification.recording import Floats

FITTED = 4
"""Candidates of a round that are fitted: each costs a simulation for every slope."""
LIGHT = 0.1
"""Of the mass that a first guess takes."""
QUICK = 10
"""Steps of a candidate's fit."""

Judged = tuple[list[Screened], float]
"""Best trial of each term, best first, and the p-value that the best must pass."""


@dataclass(frozen=True, eq=False)
class State:
    """A model, fitted, with the noise that weighs it."""

    fit: Fit
    noise: Noise
    white: Weights

    @property
    def terms(self) -> tuple[VehicleTerm, ...]:
        return self.fit.layout.model.terms


@dataclass(frozen=True, eq=False)
class Vehicle:
    """Runs of a vehicle, and terms that may explain them: a `System` of stepwise selection."""

    data: Prepared
    terms: tuple[VehicleTerm, ...]

    def beside(self, terms: Iterable[VehicleTerm]) -> list[VehicleTerm]:
        """Candidates that are not among these, nor another form of one."""
        there = set(map(effect_of, terms))
        return [term for term in self.terms if effect_of(term) not in there]

    def judged(self, state: State, rng: np.random.Generator) -> Judged:
        """Trials against what is left, and the p-value that the best must pass."""
        found = explained(state.fit, state.white, trials(state.fit, self.data, self.beside(state.terms)))
        return best_of_each(found), needed(found, state.fit.residual, rng)

    def additions(self, state: State, judged: Judged) -> list[tuple[Candidate[VehicleTerm], Fit]]:
        """The most promising, fitted: those that pass the family-wise threshold and make the BIC better."""
        ranked, threshold = judged
        promise = policy.vehicle.VEHICLE_CANDIDATE_GAIN * max((s.gain for s in ranked), default=0.0)
        out = []
        for screened in [s for s in ranked if s.gain >= promise][:FITTED]:
            term, new = screened.trial.term, self._with(state.fit, state.white, screened)
            gain, size = state.fit.chi2 - new.chi2, len(new.values[term])
            cost = size * float(np.log(new.residual.size))
            if gain > cost and chi2_sf(gain, size) < threshold:
                out.append((Candidate(term, gain, cost, at_bound(new, term)), new))
        return out

    def _with(self, now: Fit, white: Weights, screened: Screened) -> Fit:
        """The model with a screened term, everything fitted anew from the amount that screened best."""
        layout, theta = with_term(now.layout, self.data, now.theta, screened.trial.term, screened.trial.values)
        return fit(layout, theta, self.data, white, now.motions, steps=QUICK)

    def enlarged(self, _: State, better: Fit) -> State:
        """The model under the noise of its own residual."""
        return refreshed(better, self.data, self.beside(better.values))

    def reformed(self, state: State) -> State:
        """Forms of a vehicle's effects are exchanged at the end, as rivals are."""
        return state

    def unhidden(self, _state: State, _judged: Judged) -> None:
        """Nothing hides: noise is estimated beside all that the catalogue could change."""

    def without(self, state: State, term: VehicleTerm) -> Fit:
        layout, theta = without_term(state.fit.layout, self.data, state.fit.theta, term)
        return fit(layout, theta, self.data, state.white, state.fit.motions, steps=QUICK)

    def nearly_without(self, state: State, term: VehicleTerm, hopeless: float) -> Fit:
        """As quick as it is, whatever is hoped for."""
        del hopeless
        return self.without(state, term)

    def less(self, state: State, terms: Sequence[VehicleTerm]) -> State:
        """The model without these."""
        for term in terms:
            state = self.replaced(state, self.without(state, term))
        return state

    def replaced(self, state: State, other: Fit) -> State:
        """Under the same noise: chi-squares can be compared."""
        return State(other, state.noise, state.white)

    def rivals(
        self, state: State, term: VehicleTerm, less: Fit, _stood: Mapping[VehicleTerm, tuple[float, ...]]
    ) -> list[RivalTerm[VehicleTerm, Fit]]:
        """Every other term that could take most of what this one explains, where it stood before or not."""
        others = [t for t in self.beside(less.values) if t != term]
        gain = less.chi2 - state.fit.chi2
        out = []
        for screened in best_of_each(explained(less, state.white, trials(less, self.data, others)))[: FITTED + 1]:
            if screened.gain < 0.5 * gain - policy.select.RIVAL_STATED_BIC:
                continue
            other, new = screened.trial.term, self._with(less, state.white, screened)
            if not at_bound(new, other):
                more, loss = len(new.values[other]) - len(state.fit.values[term]), new.chi2 - state.fit.chi2
                bic_loss = loss + more * float(np.log(new.residual.size))
                out.append(RivalTerm(other, new, bic_loss, loss + 2 * more))
        return sorted(out, key=lambda rival: rival.bic_loss)

    def impossible(self, state: State, term: VehicleTerm) -> bool:
        return at_bound(state.fit, term)

    def rarer(self, _term: VehicleTerm, _other: VehicleTerm) -> bool:
        """No effect of a vehicle is rarer than its rivals."""
        return False

    def usual_form(self, _term: VehicleTerm, _other: VehicleTerm) -> bool:
        """No form of an effect of a vehicle goes before another."""
        return False

    def begun_better(self, _state: State, _other: State) -> bool:
        """A vehicle has no clocks that a term leads elsewhere."""
        return False

    def merged(self, _: State, _standing: Mapping[VehicleTerm, Standing[Fit, VehicleTerm]]) -> tuple[float, Fit] | None:
        """One term in the place of two is not tried: each trial is a simulation for every slope."""
        return None


def search(vehicle: Vehicle, rng: np.random.Generator) -> tuple[State, State]:
    """The baseline, and the model that nothing in the catalogue improves any more."""
    first = _baseline(vehicle.data, vehicle.terms)
    last, _, _ = forward(vehicle, first, policy.vehicle.VEHICLE_MODEL_TERMS, rng)
    return _under(first, last, vehicle.data), last


def _baseline(data: Prepared, candidates: Sequence[VehicleTerm]) -> State:
    layout = layout_of(VehicleModel(), data)
    spread = np.concatenate([np.diff(run.response, 2) for run in data.runs])
    white = float(np.median(np.abs(spread)) / 0.6745) ** 2 / 6 or 1e-6 * float(np.var(data.runs[0].response))
    noise = Noise(white, 0.0)
    rough = min(
        (fit(layout, start, data, weights(noise, data)) for start in _starts(layout, data)), key=lambda each: each.chi2
    )
    noise = noise_of(rough, data, _columns(rough, data, candidates))
    white_of = weights(noise, data)
    return State(fit(layout, rough.theta, data, white_of, rough.motions), noise, white_of)


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


def refreshed(better: Fit, data: Prepared, left: Sequence[VehicleTerm]) -> State:
    """The same model under the noise of its own residual, which must not hold what may still be added, `left`."""
    noise = noise_of(better, data, _columns(better, data, left))
    white = weights(noise, data)
    return State(fit(better.layout, better.theta, data, white, better.motions), noise, white)


def _under(first: State, last: State, data: Prepared) -> State:
    """The baseline weighed by the noise of the final model."""
    if last is first:
        return first
    return State(fit(first.fit.layout, first.fit.theta, data, last.white, first.fit.motions), last.noise, last.white)
