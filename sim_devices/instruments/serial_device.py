"""What the bench asks of the device side of a serial wire."""

from __future__ import annotations

from typing import Protocol

from sim_devices.wires.serial_line import DEFAULT_AMOUNT


class SerialDevice(Protocol):
    """Bytes in, bytes out, at times (s of the bench clock) it is given. Holds no port and no clock."""

    @property
    def faults(self) -> tuple[str, ...]:
        """Faults it can be told to have."""

    @property
    def due(self) -> float:
        """s: when `tick` has something to do next; infinity: never."""

    def feed(self, data: bytes, t: float, /) -> bytes:
        """What the host sent; returns the answer."""

    def tick(self, t: float, /) -> bytes:
        """Everything the device says by itself until t."""

    def fault(self, name: str, t: float, amount: float = DEFAULT_AMOUNT, /) -> None:
        """Have one of `faults` from now on. Raises ValueError for another name."""

    def clear(self, t: float, /) -> None:
        """Be in order again."""
