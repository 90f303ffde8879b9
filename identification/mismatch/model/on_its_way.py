"""What a rotor on its way from one level to the next does to the mean force of an interval.

It has many rates within an interval, and the force of their mean is not the mean of their forces. Two rates stand for
them, which every static term is asked at: the slope of a curve says nothing of a corner at rest. Where a command ticks
within intervals, sub_interval.py counts sample by sample.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.model.behind_drive import behind_drive
from identification.mismatch.model.model import Acting, Model, acting
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.static_gain import ROTOR, static_terms
from identification.mismatch.model.sub_interval import rotor_of
from identification.physics.term import Scale, TermContext
from identification.recording import Floats
from identification.run_history.history import History
from identification.run_history.remembered import RememberedRun
from identification.run_history.rotor_lag import Rotor, follow_rate

SLIGHT = 1e-6
"""Of the largest driver: a rotor whose rates are closer together stands still."""
MOST_SAMPLES = 32
"""In an interval in which the rotor turns round, as many stand for more."""
LEAST_BEND, MOST_BEND = 1e-4, 100.0
"""Length of an interval times the rate of following, from one that is as good as straight to one that is as good as
settled: beyond these nothing changes but what rounding and overflow make."""


class Spread(NamedTuple):
    """(M,) each."""

    one: Floats
    """A rate less the mean of the interval."""
    other: Floats
    share: Floats
    """Of the first."""
    rest: Floats
    """Of rate |rate|, what the two leave out of its mean."""


def on_its_way(model: Model, theta: Theta, run: RememberedRun, x: Floats, scale: Scale, tare: float) -> Floats | float:
    """(M,) N or 0: mean force over each interval less that of its mean rate `x` (M,), as far as a lag makes it."""
    rotor, held = rotor_of(model, theta, scale.driver), run.history.ticks is not None
    if rotor is None or not held or run.history.tick <= policy.estimate.TICK_INTERVAL:
        return 0.0
    behind, by_tick = behind_drive(model, theta, run, scale)
    before = [each for each in acting(model, theta, scale) if each[0].stage in ROTOR and each[0] not in by_tick]
    terms = [each for each in before if each[0].traits.dynamics is None and "rotation_rate" not in each[0].needs]
    key = ("spread", rotor, tuple(each[:2] for each in terms))
    spread: Spread | None = run.gains(key, lambda: _spread(_through(terms, behind, theta), x, rotor, run.history), x)
    return 0.0 if spread is None else _force_beside(model, theta, run, x, scale, tare, spread)


def _through(terms: list[Acting], run: RememberedRun, theta: Theta) -> Floats:
    """(M,) where a rotor goes to: what terms make of the driver."""
    value = run.history.driver
    for term, values, sizes in terms:
        value = term.apply(value, TermContext(run, sizes, theta.C, 0.0, value), values)
    return value


def _spread(w: Floats, x: Floats, rotor: Rotor, history: History) -> Spread | None:
    """Of a rotor that goes to w and has the mean rates x, an exponential in each interval; None where it stands."""
    few, span = np.maximum(history.count, 1).astype(np.float64), history.dt
    if history.converter.instant:
        span = np.minimum(span, few * history.spacing)
    else:
        few = np.full(x.size, np.inf)
    gap, bend = x - w, np.clip(follow_rate(w, x, rotor) * span, LEAST_BEND, MOST_BEND)
    half = 0.5 * bend
    scatter = np.abs(gap) * np.sqrt(np.maximum(half / np.tanh(half) - 1, 0.0) * (1 - 1 / few**2))
    if float(np.max(scatter, initial=0.0)) < SLIGHT * history.size:
        return None
    reach = gap * half / np.sinh(half)
    rows = np.flatnonzero((w + reach * np.exp(half)) * (w + reach * np.exp(-half)) < 0)
    out = Spread(scatter, -scatter, np.full(x.size, 0.5), np.zeros(x.size))
    many = np.minimum(few[rows], MOST_SAMPLES)[:, np.newaxis]
    place = (np.arange(MOST_SAMPLES) + 0.5) / many
    rates = w[rows, np.newaxis] + reach[rows, np.newaxis] * np.exp(bend[rows, np.newaxis] * (0.5 - place))
    for column, told in zip(out, _either_way(rates, place < 1, x[rows]), strict=True):
        column[rows] = told
    return out


def _either_way(rates: Floats, there: NDArray[np.bool_], x: Floats) -> Spread:
    """Of rates (k, MOST_SAMPLES), as far as they are `there`, the means of those ahead and of those in reverse, less x
    (k,)."""
    many = np.sum(there, axis=1)
    parts = []
    for side in (there & (rates > 0), there & (rates <= 0)):
        count = np.sum(side, axis=1)
        mean = np.sum(rates * side, axis=1) / np.maximum(count, 1)
        parts.append((mean - x, count / many, np.sum((rates - mean[:, np.newaxis]) ** 2 * side, axis=1) / many))
    (ahead, share, scatter), (reverse, _, scatter_reverse) = parts
    return Spread(ahead, reverse, share, scatter - scatter_reverse)


def _force_beside(
    model: Model, theta: Theta, run: RememberedRun, x: Floats, scale: Scale, tare: float, spread: Spread
) -> Floats:
    """(M,) N: term by term, so that a model that has one more than another has what the rest makes of the rates."""
    rates = run.gains(("rates", theta.C), lambda: (x, x + spread.one, x + spread.other), x, spread)
    forces = run.gains(("forces", theta.C), lambda: [theta.C * rate * np.abs(rate) for rate in rates], rates)
    key: object = (theta.C, tare)
    for each in static_terms(model, theta, scale):
        if each[0].stage not in ROTOR:
            key = (key, each[:2])
            forces = run.gains(("forces", key), partial(_passed, each, forces, rates, theta.C, tare, run), rates)
    at, one, other = forces
    out: Floats = spread.share * (one - at) + (1 - spread.share) * (other - at) + theta.C * spread.rest
    return out


def _passed(
    each: Acting, forces: list[Floats], rates: tuple[Floats, ...], C: float, tare: float, run: RememberedRun
) -> list[Floats]:
    term, values, sizes = each
    contexts = (TermContext(run, sizes, C, tare, rate, before=rates[0]) for rate in rates)
    return [term.apply(force, now, values) for force, now in zip(forces, contexts, strict=True)]
