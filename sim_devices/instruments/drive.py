"""What the bench asks of whatever turns the thruster, beside its wire."""

from __future__ import annotations

from typing import Protocol


class Drive(Protocol):
    """The power stage of a motor controller."""

    def drive(self, n: float, dt: float, /) -> tuple[float | None, float]:
        """(volts, amps) for one world step of dt (s) at n (rev/s): volts None means that the windings carry amps."""
