"""How a wave that is locked to the rotor grows with the speed.

Forces of the rotor grow with the square of its rate: imbalance m e (2 pi n)^2 at 1 x n, blade pass b rho n^2 D^4 at
z x n (Carlton 2007, *Marine Propellers and Propulsion*); on a stand that rings they are multiplied by its response at
z n. What is picked up electrically from a turning rotor has one size at all speeds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.mismatch.periodic.steady_segments import SteadySegment
from identification.recording import Floats

Ring = tuple[float, float, float]
"""Compliance, frequency in Hz and damping of a stand that rings."""


@dataclass(frozen=True, slots=True)
class OrderLaw:
    """How the size of a wave that goes with the rotor changes with its speed: by a power, and by what rings with it."""

    growth: int
    """Power of the speed that its force goes with: 2, or 0 of a pick-up."""
    ring: Ring | None = None

    def weight(self, order: float, speed: Floats, top: float) -> NDArray[np.complex128]:
        """(n,) of its force at the highest speed `top`, what the cell shows of it at `speed` (n,), in turns per s."""
        weight = ((speed / top) ** self.growth).astype(np.complex128)
        if self.ring is not None:
            weight *= response(self.ring, order * speed)
        return weight

    def on(self, parts: Sequence[SteadySegment], order: float, top: float) -> list[SteadySegment]:
        """The stretches, each sample weighed by what it holds of such a wave: a mean over time turns its sign where
        the wave becomes shorter than its window."""
        return [
            replace(p, weight=self.weight(order, p.turning, top) * p.converter.response(order * p.turning))
            for p in parts
        ]


FORCE = OrderLaw(2)
"""Of the rotor, by the square of its rate."""
PICK_UP = OrderLaw(0)
"""Electrical, of one size at all speeds."""


def laws(ring: Ring | None) -> tuple[OrderLaw, ...]:
    """In the order in which they are to be believed where the speeds do not tell them apart."""
    return (FORCE, PICK_UP) if ring is None else (FORCE, OrderLaw(2, ring), PICK_UP)


def response(ring: Ring, frequency: Floats) -> NDArray[np.complex128]:
    """(n,) at these frequencies, of a mass on a spring that takes a share `compliance` of the force.

    >>> np.abs(response((1.0, 10.0, 0.05), np.array([10.0, 0.1]))).round(3).tolist()
    [10.0, 1.0]
    """
    compliance, natural, damping = ring
    r = frequency / natural
    return np.asarray(1 + compliance * (1 / (1 - r * r + 2j * damping * r) - 1), dtype=np.complex128)
