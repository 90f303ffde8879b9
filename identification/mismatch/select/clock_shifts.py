"""Where the clocks of force and rate stand against the command's, looked for over all that they may be apart.

A command that ticks moves its samples by whole ticks: the misfit has a hollow wherever another one has passed its tick,
and a fit that begins in the wrong hollow stays there. Whatever smooths the ticks then seems to be in the data.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from identification.mismatch.estimate.fitting import raw
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.recording import Floats

COARSE, FINE = 24, 10
"""Steps from nothing to the most, and of one of those once it is found."""
WORTH = 0.02
"""Share of the sum of squares that another place must take away: what is as good stays where it was."""


def with_clock_shifts(model: Model, theta: Theta, data: Data) -> Theta:
    """Where a fit begins; as given where the clocks agree, or no run ticks."""
    if data.most_shift <= 0 or not any(h.ticks is not None for h in data.histories):
        return theta
    if data.with_rate:
        rates = [h.rates for h in data.histories]

        def beside_rate(shift: float) -> float:
            _, told = raw(model, replace(theta, rate_shift=shift), data, with_rate=True)
            return _misfit(rates, told)

        theta = replace(theta, rate_shift=_likeliest(theta.rate_shift, data.most_shift, beside_rate))
    if any(term.traits.delay for term in model.terms):
        return theta

    def beside_thrust(shift: float) -> float:
        told, _ = raw(model, replace(theta, shift=shift), data, with_rate=False)
        return _misfit(data.thrust, told)

    return replace(theta, shift=_likeliest(theta.shift, data.most_shift, beside_thrust))


def _likeliest(given: float, most: float, misfit: Callable[[float], float]) -> float:
    def at(shift: float) -> tuple[float, float]:
        shift = float(np.clip(shift, -most, most))
        return misfit(shift), shift

    step = most / COARSE
    _, there = min(at(i * step) for i in range(-COARSE, COARSE + 1))
    least, there = min(at(there + i * step / FINE) for i in range(-FINE, FINE + 1))
    return there if least < (1 - WORTH) * misfit(given) else given


def _misfit(seen: Sequence[Floats], told: Sequence[Floats]) -> float:
    """Sum of squares beside a gain that all runs share and a zero of each."""
    y = np.concatenate([v - v.mean() for v in seen])
    f = np.concatenate([v - v.mean() for v in told])
    gain = float(f @ y) / max(float(f @ f), 1e-300)
    return float(np.sum((y - gain * f) ** 2))
