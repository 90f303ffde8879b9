"""How visible an effect that came on top is to whom knows no amounts: they are learned from both recordings.

As in `oracle`, d'^2 is what the baseline's columns leave of the effect; beside them stands what changes with the amount
of each effect that the thruster had before, in both recordings. The shapes of all and the noise stay known.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sim_devices.concealed.cases.definition import Case
from sim_devices.concealed.visibility.oracle import with_amount
from sim_devices.concealed.visibility.projection import Projection, signals

Floats = NDArray[np.float64]

STEP = 0.01
"""Share of an amount by which it is moved for its column."""


def beside_first(first: Case, second: Case, effect: str) -> float:
    """Sigma at which `effect`, of `second` alone, is seen where `first` and `second` must tell all other amounts."""
    before, without = signals(first), signals(second, frozenset({effect}))
    values = [*before, *without]
    slopes = [_slope(first, second, effect, each.effect, values) for each in first.effects]
    columns = [slope for slope in slopes if any(map(np.any, slope))]  # no threshold between the levels moves any thrust
    both = replace(second, runs=(*first.runs, *second.runs))
    return Projection(both, values, columns).strength([*before, *signals(second)], values)


def _slope(first: Case, second: Case, effect: str, known: str, values: list[Floats]) -> list[Floats]:
    """Of each run's thrust, along the amount of `known`; in the unit of STEP of it."""
    amount = (1.0 + STEP) * next(c.amount for c in first.effects if c.effect == known)
    moved = [
        *signals(with_amount(first, known, amount)),
        *signals(with_amount(second, known, amount), frozenset({effect})),
    ]
    return [a - b for a, b in zip(moved, values, strict=True)]
