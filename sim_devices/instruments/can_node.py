"""What the bench asks of a device on its CAN bus."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from sim_devices.wires.can_frame import CanFrame
from sim_devices.wires.serial_line import DEFAULT_AMOUNT


class CanNode(Protocol):
    """Frames in, frames out, at times (s of the bench clock) it is given. Holds no port and no clock."""

    @property
    def faults(self) -> tuple[str, ...]:
        """Faults it can be told to have."""

    @property
    def due(self) -> float:
        """s: when `tick` has something to do next; infinity: never."""

    def receive(self, frame: CanFrame, t: float, /) -> Sequence[CanFrame]:
        """A frame of somebody else on the bus; returns the answers."""

    def tick(self, t: float, /) -> Sequence[CanFrame]:
        """Everything the device says by itself until t."""

    def fault(self, name: str, t: float, amount: float = DEFAULT_AMOUNT, /) -> None:
        """Have one of `faults` from now on. Raises ValueError for another name."""

    def clear(self, t: float, /) -> None:
        """Be in order again."""
