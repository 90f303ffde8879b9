"""A serial line between device and host: how long bytes take, and what can go wrong on the way. Pure: no port."""

from __future__ import annotations

from collections import deque
from math import inf

import numpy as np

BITS_PER_CHARACTER = 10
"""8N1: start, eight, stop."""
MAX_AGE = 0.25
"""s a finished message may wait for a host that does not read before it is dropped whole: a device has no memory."""
MAX_BACKLOG = 1.0
"""s of line time that may be waiting; a device that talks more than its line carries loses whole messages."""
WIRE_FAULTS = ("dropped", "duplicated", "corrupted", "merged", "shifted", "delayed")
"""This share of the messages (0..1) is dropped, comes twice, has one bit flipped, has lost its line end, has lost one
byte. delayed: every message, by this many seconds."""
DEFAULT_AMOUNT = 0.1


class Wire:
    """Messages in, bytes out at the times the line rate allows."""

    def __init__(self, baud: float | None, rng: np.random.Generator) -> None:
        """Baud None: no limit (USB adapter)."""
        self._seconds_per_byte = BITS_PER_CHARACTER / baud if baud else 0.0
        self._rng = rng
        self._busy_until = -inf
        self._queue: deque[tuple[float, bytes]] = deque()
        self._started = b""
        self._faults: dict[str, float] = {}
        self.lost = 0
        """messages dropped because the line was full or nobody read."""

    def fault(self, name: str, amount: float) -> None:
        """Have one of WIRE_FAULTS from now on. Raises ValueError."""
        if name not in WIRE_FAULTS:
            raise ValueError(f"wire: expected one of {', '.join(WIRE_FAULTS)}, got {name!r}")
        self._faults[name] = amount

    def clear(self) -> None:
        self._faults = {}

    def put(self, message: bytes, t: float, turnaround: float = 0.0) -> None:
        """The device starts to say `message` at t (s), `turnaround` later if it was asked."""
        for copy in self._spoilt(message):
            begin = max(t + turnaround + self._faults.get("delayed", 0.0), self._busy_until)
            if begin - t > MAX_BACKLOG + turnaround + self._faults.get("delayed", 0.0):
                self.lost += 1
                continue
            self._busy_until = begin + len(copy) * self._seconds_per_byte
            self._queue.append((self._busy_until, copy))

    def _spoilt(self, message: bytes) -> list[bytes]:
        if not self._faults:
            return [message]
        if self._hits("dropped"):
            return []
        spoilt = bytearray(message)
        if self._hits("corrupted"):
            spoilt[int(self._rng.integers(len(spoilt)))] ^= 1 << int(self._rng.integers(8))
        if self._hits("merged"):
            spoilt = spoilt.rstrip(b"\r\n")
        if self._hits("shifted"):
            del spoilt[int(self._rng.integers(len(spoilt)))]
        return [bytes(spoilt)] * (2 if self._hits("duplicated") else 1)

    def _hits(self, name: str) -> bool:
        return name in self._faults and self._rng.random() < self._faults[name]

    @property
    def due(self) -> float:
        """s: when `ready` has bytes; infinity: never."""
        if self._started:
            return -inf
        return self._queue[0][0] if self._queue else inf

    def ready(self, t: float) -> bytes:
        """The bytes that have arrived by t: the rest of a message begun, or the next one. Empty: nothing."""
        while self._queue and self._queue[0][0] <= t - MAX_AGE:
            self._queue.popleft()
            self.lost += 1
        if self._started:
            return self._started
        return self._queue[0][1] if self._queue and self._queue[0][0] <= t else b""

    def taken(self, count: int) -> None:
        """The host's buffer took `count` of the bytes that `ready` gave. A message not begun can still grow old."""
        if count and not self._started:
            self._started = self._queue.popleft()[1]
        self._started = self._started[count:]

    def unplug(self) -> None:
        """Whatever was under way is gone."""
        self._queue.clear()
        self._started, self._busy_until = b"", -inf
