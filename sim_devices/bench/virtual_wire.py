"""A wire between host and device in virtual time: what each says is under way for a while, and in order."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Protocol

import numpy as np

from sim_devices.wires.serial_line import Wire

Arrived = Callable[[int, bytes], None]


@dataclass(frozen=True, slots=True)
class Host:
    """The computer of the rig and its adapters: what lies between a wire and a stamp, or a decision and a wire. s."""

    adapter: float = 0.0
    """A byte is in the adapter for so long, either way."""
    work: float = 0.0
    """From the begin of a turn of the control loop to its command."""
    reader_late: float = 0.0
    """Mean (exponential) of the time that a reader waits for the processor, and with it its stamp."""
    loop_late: float = 0.0
    """The same of the control loop."""
    stall_every: float = inf
    """Mean time between two stalls of the processor."""
    stall: float = 0.0
    """Longest of them."""


class Time(Protocol):
    """The bench, as its wires see it."""

    def now(self) -> float: ...

    def wait(self, seconds: float) -> object: ...

    def stamp(self, t: float) -> int:
        """Ns of the host's clock at t (s)."""


class VirtualWire:
    """The near end is what a driver talks to; the far end hears what was said when it has arrived."""

    def __init__(self, name: str, time: Time, wire: Wire, host: Host, rng: np.random.Generator) -> None:
        self.name, self.wire = name, wire
        self._time, self._host, self._rng = time, host, rng
        self._arrived: Arrived | None = None
        self._to_device: deque[tuple[float, bytes]] = deque()
        self._to_host: deque[tuple[float, bytes]] = deque()
        self._busy = -inf

    # -- the near end ------------------------------------------------------------------------------------------------

    def now(self) -> float:
        """S of the clock that stamps what arrives."""
        return self._time.stamp(self._time.now()) * 1e-9

    def wait(self, seconds: float) -> object:
        return self._time.wait(seconds)

    def connect(self, arrived: Arrived) -> None:
        self._to_host.clear()
        self._arrived = arrived

    def write(self, data: bytes) -> None:
        self._to_device.append((self._time.now() + self._host.work + self._host.adapter, data))

    def disconnect(self) -> None:
        self._arrived = None

    # -- the far end -------------------------------------------------------------------------------------------------

    @property
    def due(self) -> float:
        """s: when something arrives at either end, or leaves the line; infinity: never."""
        said = self._to_device[0][0] if self._to_device else inf
        come = self._to_host[0][0] if self._to_host else inf
        return min(said, come, self.wire.due)

    def heard(self, t: float) -> bytes:
        """What the device has by t of the host's words, and was not told yet."""
        data = b""
        while self._to_device and self._to_device[0][0] <= t:
            data += self._to_device.popleft()[1]
        return data

    def carry(self, t: float) -> bool:
        """Bring what left the line by t to the host; whether any of it was told."""
        while data := self.wire.ready(t):
            self.wire.taken(len(data))
            late = self._host.adapter + self._host.reader_late * float(self._rng.standard_exponential())
            self._busy = max(self._busy, t + late)
            self._to_host.append((self._busy, data))
        told = False
        while self._to_host and self._to_host[0][0] <= t:
            at, data = self._to_host.popleft()
            if self._arrived is not None:
                self._arrived(self._time.stamp(at), data)
                told = True
        return told

    def stall(self, t: float) -> None:
        """No reader runs before t (s)."""
        self._busy = max(self._busy, t)
