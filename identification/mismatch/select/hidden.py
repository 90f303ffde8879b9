"""Terms that slow noise had taken for its own: no screening shows them, they are told apart when estimated together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.estimation.tails import chi2_isf
from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate, by_itself, refresh, refreshed_once
from identification.mismatch.estimate.fitting import Fit, fit
from identification.mismatch.model.data import Data, price
from identification.mismatch.model.parameters import Theta
from identification.mismatch.select.overdispersion import dispersion_of
from identification.mismatch.select.rounds import Unhidden
from identification.mismatch.select.screening import Screening, refined
from identification.physics.term import Term

SLOW_COVARIATES = frozenset({"time", "flow_speed"})
"""Coordinates along which nothing changes quickly: slow noise takes for its own what an effect does over them."""
MOST_HIDDEN = 3
"""Terms of a round that are estimated together with the noise: each costs a search for variances."""
MOST_INSTANTS = 5
"""Trials of a jump that is hidden: which is the best depends on the noise, and each costs a search for variances."""
INSTANTS_APART = 0.05
"""Of the run: trials of a jump that is hidden."""


def hidden(estimate: Estimate, judged: Screening, data: Data) -> tuple[Unhidden, Estimate] | None:
    """The model with a term that the noise had taken for its own: they are told apart when estimated together."""
    least = (
        policy.select.HIDDEN_FIRST_TERM_SIGMA if not estimate.fit.model.terms else np.inf
    )  # shape error would be taken for what is hidden
    likely = [
        (t, v)
        for rank, (t, v, z) in enumerate(judged.best(2 * MOST_HIDDEN))
        if (rank < MOST_HIDDEN or t.traits.one_shape)
        and z > (policy.select.HIDDEN_SIGMA if SLOW_COVARIATES & set(t.covariates) else least)
    ]
    likely = [each for t, v in likely for each in ((t, at) for at in _instants(judged, t, data) or (v,))]
    if not likely:
        return None
    now = by_itself(estimate, data)
    found = []
    for term, values in likely:
        new = _together(estimate, term, values, data)
        gain = (now.fit.deviance - new.fit.deviance) / dispersion_of(term, new.fit, data.size)
        if gain > (asked := asked_of(term, judged, data)):
            found.append((Unhidden(gain, asked), new))
    if not found:
        return None
    told, best = max(found, key=lambda each: each[0].gain)
    return told, refresh(best.fit.model, best.fit.theta, data, None, None)


def _together(estimate: Estimate, term: Term, values: tuple[float, ...], data: Data) -> Estimate:
    """The model with the term, estimated together with the noise; once for all who ask."""

    def made() -> Estimate:
        now, begin = by_itself(estimate, data), refined(estimate.fit, data, estimate.weights, term, values)
        bigger, theta = estimate.fit.more(term, begin)
        first = fit(bigger, theta, data, estimate.weights, near=estimate.fit)
        return refreshed_once(bigger, _by_the_clocks_of(now, first), data, None, now, now.noise)

    found: Estimate = data.predictor.once(("together", term, values), made, estimate)
    return found


def _by_the_clocks_of(now: Estimate, first: Fit) -> Theta:
    """The values of a fit with clocks that are to be compared: one reading of the rate on the other side of a tick is
    worth more than what is asked of a term. A delay has none beside it."""
    if any(term.traits.delay for term in first.model.terms):
        return first.theta
    return replace(first.theta, shift=now.fit.theta.shift, rate_shift=now.fit.theta.rate_shift)


def taken_by_noise(whole: Estimate, less: Estimate, judged: Screening, data: Data) -> bool:
    """Whether the terms that `less` lacks of the `whole` gain, estimated together with the noise, what is asked of one
    that is hidden; `judged`: of `less`."""
    noise = by_itself(less, data)
    told = refresh(whole.fit.model, _by_the_clocks_of(noise, whole.fit), data, None, noise, noise.noise)
    lacking = set(whole.fit.model.terms) - set(less.fit.model.terms)
    return noise.fit.deviance - told.fit.deviance > sum(asked_of(term, judged, data) for term in lacking)


def _instants(judged: Screening, term: Term, data: Data) -> list[tuple[float, ...]]:
    """Of a jump in time the likeliest trials: which is the best depends on the noise, and that takes it for its own."""
    if not term.traits.instant:
        return []
    place = [p.name for p in term.parameters(data.scale)].index(term.traits.instant)
    out: list[tuple[float, ...]] = []
    for j in np.argsort(-judged.plain):
        at = judged.directions.values[j]
        if judged.directions.terms[j] == term and all(
            abs(at[place] - v[place]) > INSTANTS_APART * data.scale.duration for v in out
        ):
            out.append(at)
        if len(out) == MOST_INSTANTS:
            break
    return out


def asked_of(term: Term, judged: Screening, data: Data) -> float:
    """Gain in deviance from which a term that is told from noise by estimating both is believed."""
    if term.traits.one_shape:
        return chi2_isf(policy.select.STEADY_TERM_FALSE_ALARM, price(term, data))
    share = 1.0 if term.traits.from_data else _share_of_hidden(term)
    return float(judged.threshold**2 + share * price(term, data) * np.log(data.size))


def _share_of_hidden(term: Term) -> float:
    return float(policy.select.HIDDEN_OFFSET_PRICE if term.traits.instant else policy.select.HIDDEN_TERM_PRICE)
