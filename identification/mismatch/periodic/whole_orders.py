"""Whole orders of the rotor in samples that are means over time, or that pass a filter.

What such a sample holds of a wave depends on the wave's own frequency, and turns its sign where the window becomes
longer than a period: over the speeds of a run a search over all ratios at once adds up waves of both signs. Blades,
bolts and bearings come a whole number of times a turn; each is looked for as its own samples would show it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from identification.estimation.tails import gamma_sf
from identification.mismatch import policy
from identification.mismatch.periodic.order_search import (
    LASTING,
    ORDERS,
    OrderCandidate,
    Piece,
    even,
    longest_of,
    pieces_of,
)
from identification.mismatch.periodic.steady_segments import SteadySegment
from identification.recording import Floats

NEAR = np.arange(-4, 5)
"""Ratios round an order, in parts of the resolution of the longest piece."""
PARTS = 4
"""Of that resolution."""
BESIDE = np.array([*range(-28, -11, 2), *range(12, 29, 2)])
"""The same beside it, which tell how loud the noise is."""


def whole_orders(on: Callable[[float], Sequence[SteadySegment]], top: float) -> list[OrderCandidate]:
    """The clearest for each time that a phase may last, its p-value that of all of them; `on`: an order to the
    stretches, weighed by what their samples hold of it, `top`: highest speed, turns per s."""
    low, high = policy.periodic.LOWEST_ORDER / top, policy.periodic.HIGHEST_ORDER / top
    orders = [order for order in range(1, ORDERS + 1) if low <= order <= high]
    weighed = [(order, on(float(order))) for order in orders]
    tried = len(orders) * len(LASTING) * NEAR.size / PARTS
    found = [
        min((_clearest(parts, order, top, seconds, tried) for order, parts in weighed), key=lambda each: each.p_value)
        for seconds in LASTING
        if weighed
    ]
    return [each for each in found if each.p_value < 1.0]


def _clearest(parts: Sequence[SteadySegment], order: int, top: float, seconds: float, tried: float) -> OrderCandidate:
    pieces = pieces_of(parts, top, seconds)
    resolution = 1.0 / longest_of(pieces)
    offsets = np.concatenate([NEAR, BESIDE]) * (resolution / PARTS)
    power = _powers(pieces, order, offsets)
    level = max(float(np.mean(power[NEAR.size :])) / len(pieces), 1.0)
    at = int(np.argmax(power[: NEAR.size]))
    ratio = order + float(offsets[at])
    p_value = min(tried * float(gamma_sf(float(power[at]) / level, float(len(pieces)))), 1.0)
    if p_value < policy.periodic.LINE_FALSE_ALARM:
        p_value = max(p_value, even(pieces, ratio))
    return OrderCandidate(ratio, resolution, p_value)


def _powers(pieces: Sequence[Piece], order: int, offsets: Floats) -> Floats:
    """(k,) at these ratios beside the order: |sum of waves|^2 over what noise alone gives, summed over the pieces."""
    out = np.zeros(offsets.size)
    for piece in pieces:
        turns = np.concatenate([p.turns for p, _ in piece])
        value = np.concatenate([np.conj(p.weight) * p.white for p, _ in piece])
        value *= np.exp(-2j * np.pi * order * turns)
        waves = np.array([value @ np.exp(-2j * np.pi * offset * turns) for offset in offsets.tolist()])
        out += np.abs(waves) ** 2 / sum(p.information for p, _ in piece)
    return out
