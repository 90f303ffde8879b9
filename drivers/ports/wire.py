"""The near end of a wire whose far end and time belong to whoever opened it: a bench in virtual time, a replay."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

Arrived = Callable[[int, bytes], None]
"""`arrived(t_ns, data)`: bytes that came, and when (ns of the wire's own clock)."""


class Wire(Protocol):
    """Bytes out by `write`; bytes in by the function that was given to `connect`, while its time passes."""

    def now(self) -> float:
        """Time of the wire's clock, s."""

    def wait(self, seconds: float) -> object:
        """Let time pass until bytes have come on any wire of that clock, at most so long."""

    def connect(self, arrived: Arrived) -> None:
        """From now on tell `arrived` what comes; what came before is lost."""

    def write(self, data: bytes) -> None: ...

    def disconnect(self) -> None:
        """Tell nobody any more; safe to call twice."""


class SerialOverWire:
    """What python-can's slcan wants of a serial port that it writes to, over a wire."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self.write_timeout: float | None = None

    def write(self, data: bytes) -> int:
        self._wire.write(data)
        return len(data)

    def flush(self) -> None:
        """What is written has left already."""

    def close(self) -> None:
        self._wire.disconnect()
