"""How a wave that is locked to the rotor grows with the speed.

Forces of the rotor grow with the square of its rate: imbalance m e (2 pi n)^2 at 1 x n, blade pass b rho n^2 D^4 at
z x n (Carlton 2007, *Marine Propellers and Propulsion*); on a stand that rings they are multiplied by its response at
z n. What is picked up electrically from a turning rotor has one size at all speeds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from identification.mismatch.periodic.steady_segments import SteadySegment

Ring = tuple[float, float, float]
"""Compliance, frequency in Hz and damping of a stand that rings."""


@dataclass(frozen=True, slots=True)
class OrderLaw:
    """How the size of a wave that goes with the rotor changes with its speed: by a power, and by what rings with it."""

    growth: int
    """Power of the speed that its force goes with: 2, or 0 of a pick-up."""
    ring: Ring | None = None

    def weight(self, order: float, speed: float, top: float) -> complex:
        """Of its force at the highest speed `top`, what the cell shows of it at `speed`, both in turns per s."""
        return (speed / top) ** self.growth * (1.0 if self.ring is None else response(self.ring, order * speed))

    def on(self, parts: Sequence[SteadySegment], order: float, top: float) -> list[SteadySegment]:
        """The stretches, each weighed by what its samples hold of such a wave."""
        return [
            replace(p, weight=self.weight(order, p.speed, top) * p.converter.response(order * p.speed)) for p in parts
        ]


FORCE = OrderLaw(2)
"""Of the rotor, by the square of its rate."""
PICK_UP = OrderLaw(0)
"""Electrical, of one size at all speeds."""


def laws(ring: Ring | None) -> tuple[OrderLaw, ...]:
    """In the order in which they are to be believed where the speeds do not tell them apart."""
    return (FORCE, PICK_UP) if ring is None else (FORCE, OrderLaw(2, ring), PICK_UP)


def response(ring: Ring, frequency: float) -> complex:
    """Of a mass on a spring that takes a share `compliance` of the force.

    >>> round(abs(response((1.0, 10.0, 0.05), 10.0)), 3), round(abs(response((1.0, 10.0, 0.05), 0.1)), 3)
    (10.0, 1.0)
    """
    compliance, natural, damping = ring
    r = frequency / natural
    return 1 + compliance * (1 / complex(1 - r * r, 2 * damping * r) - 1)
