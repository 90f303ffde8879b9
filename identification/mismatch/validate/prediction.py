"""What was not fitted: a name must predict it, and what has no name stays in the model only where it does."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from identification.mismatch.estimate.estimate import State
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.model.model import Data, Model, Theta
from identification.mismatch.select.baseline import baseline
from identification.mismatch.unnamed.flexible import Parted, better, split
from identification.physics.term import Term
from identification.run_history.history import History

EVENTS = frozenset({"zero_offset", "zero_drift", "time_skew"})
"""Of one run's own clocks: another run need not repeat them."""
WORSE = 9.0
"""Of whitened chi-square on what was not fitted: a model that does so much better without a term doubts its name."""


def unforeseen(parted: Parted, terms: Collection[Term], *, same_run: bool) -> tuple[Term, ...]:
    """Of these terms those without which the model predicts what was not fitted better.

    `same_run`: that is blocks of time of the runs that were fitted. The noise of other runs may be another, which is
    why their errors must fall as well.
    """
    state, now = parted.state, parted.judge(parted.state.fit)
    asked = [t for t in state.fit.model.terms if t in terms and (same_run or t.id not in EVENTS)]
    less = {t: parted.judge(fit(*without_terms(state, [t]), parted.data, state.weights)) for t in asked}
    most = np.inf if same_run else now.rmse
    return tuple(t for t, score in less.items() if score.chi2 < now.chi2 - WORSE and score.rmse < most)


def predicting(
    after: State,
    parted: Parted,
    data: Data,
    terms: Sequence[Term],
    doubted: Collection[Term],
    others: Sequence[History],
) -> State:
    """The model, without the terms whose name was not earned where these make the prediction no better.

    Both are fitted to a part of the data and judged on the rest; with `others`, on those runs. `terms`: whose shapes
    are taken out of the noise of the smaller one, as before any was found. `parted`: `after`, so fitted.
    """
    if not doubted:
        return after
    smaller, theta = without_terms(after, doubted)
    bare = baseline(data, theta, terms, smaller)
    smaller_fit = split(bare, data, others).state.fit
    return after if better(parted.judge(parted.state.fit), parted.judge(smaller_fit), 0) else bare


def predicts(state: State, before: State, data: Data, others: Sequence[History]) -> bool:
    """Whether the model predicts what was not fitted better than the baseline, `before`."""
    parted = split(state, data, others)
    plain = fit(before.fit.model, before.fit.theta, parted.data, parted.state.weights)
    return parted.judge(parted.state.fit).rmse < parted.judge(plain).rmse


def without_terms(state: State, terms: Collection[Term]) -> tuple[Model, Theta]:
    """The rest of the model, its values as they were."""
    model, theta = state.fit.model, state.fit.theta
    kept = tuple(v for t, v in zip(model.terms, theta.terms, strict=True) if t not in terms)
    return replace(model, terms=tuple(t for t in model.terms if t not in terms)), replace(theta, terms=kept)
