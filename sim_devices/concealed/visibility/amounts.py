"""Another amount of an effect that is there already, so much more or less as an oracle sees the change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from sim_devices.concealed.cases.definition import Case
from sim_devices.concealed.visibility.oracle import OutOfReach, with_amount
from sim_devices.concealed.visibility.projection import Projection, signals

LEAST, MOST = 1.1, 2.5
"""Factors between which an amount changes, or their inverses: a diagnosis may trust a known form to a hundredth of what
it does, and nobody asks about less than a tenth."""
CLOSE = 0.02
"""Of the factor's logarithm."""


def changed_at(case: Case, effect: str, d_prime: float, rng: np.random.Generator) -> Case:
    """The case with less of `effect`, or more, than it has: the change is seen at `d_prime`, and at least LEAST.

    `seen` of the effect is then the strength of the change. Raises OutOfReach where no amount within bounds and MOST is
    seen so.
    """
    (own,) = [c for c in case.effects if c.effect == effect]
    before = signals(case)
    projection, up = Projection(case, before), bool(rng.random() < 0.5)

    def amount(log_factor: float) -> float:
        return float(own.amount * np.exp(log_factor if up else -log_factor))

    def seen(log_factor: float) -> float:
        return projection.strength(signals(with_amount(case, effect, amount(log_factor))), before)

    low, high = float(np.log(LEAST)), float(np.log(MOST))
    if up:
        high = min(high, float(np.log(own.shape.highest / own.amount)))
    if high <= low or seen(high) < d_prime:
        raise OutOfReach(f"{effect} is not seen to change at {d_prime:.3g} sigma: draw another case")
    if seen(low) < d_prime:
        low = float(brentq(lambda x: np.log(max(seen(x), 1e-9) / d_prime), low, high, xtol=CLOSE * low))
    moved = with_amount(case, effect, amount(low))
    strength = seen(low)
    effects = tuple(replace(c, seen=strength) if c.effect == effect else c for c in moved.effects)
    return replace(moved, effects=effects)
