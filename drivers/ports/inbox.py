"""The queue between a reader thread and the rig: bounded, stamped, counted."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from typing import Generic, Protocol, TypeVar

from drivers.ports.arrivals import Arrivals

Record = TypeVar("Record")

FIRST_BAD_KEPT = 5
"""How many of the lines or frames that could not be understood are kept word for word."""


class BadRecords:
    """Counts what could not be understood and keeps the first few, so that nothing is dropped silently."""

    def __init__(self) -> None:
        self.count = 0
        self.first: tuple[str, ...] = ()

    def add(self, text: str) -> None:
        self.count += 1
        if len(self.first) < FIRST_BAD_KEPT:
            self.first = (*self.first, text)


class Passing(Protocol):
    """A time other than the machine's: it passes while somebody waits, and records may be put meanwhile."""

    def now(self) -> float: ...

    def wait(self, seconds: float) -> object: ...


class Inbox(Generic[Record]):
    """Records with their arrival time. Many may put, one takes. When full the oldest go, and are counted."""

    def __init__(self, capacity: int, passing: Passing | None = None, arrivals: Arrivals | None = None) -> None:
        """`passing`: the time that `wait_for` waits in; None: the machine's.

        `arrivals`: bytes whose decoder puts into this inbox, decoded when somebody looks into it.
        """
        if capacity < 1:
            raise ValueError(f"inbox capacity must be at least 1, not {capacity}")
        self._received = 0
        self._dropped = 0
        self._arrivals = arrivals
        self._capacity = capacity
        self._rows: deque[tuple[int, Record]] = deque(maxlen=capacity)
        self._arrival = threading.Condition()
        self._now = time.monotonic if passing is None else passing.now
        self._wait: Callable[[float], object] = self._arrival.wait if passing is None else passing.wait
        self._open = True

    @property
    def received(self) -> int:
        """Records so far."""
        self._look()
        return self._received

    @property
    def dropped(self) -> int:
        """Records that went because the inbox was full."""
        self._look()
        return self._dropped

    def put(self, rows: Sequence[tuple[int, Record]]) -> None:
        """Add records, each with when it came (ns, `time.monotonic_ns()`)."""
        with self._arrival:
            self._dropped += max(0, len(self._rows) + len(rows) - self._capacity)
            self._rows.extend(rows)
            self._received += len(rows)
            self._arrival.notify_all()

    def take_all(self) -> list[tuple[int, Record]]:
        """Everything since the last call; never blocks on the wire."""
        self._look()
        with self._arrival:
            rows = list(self._rows)
            self._rows.clear()
        return rows

    def wait_for(self, match: Callable[[Record], bool], timeout: float, *, take: bool = True) -> Record | None:
        """The first record that matches, waiting up to `timeout` s; None when it did not come or the link ended.

        With `take` it leaves the inbox; records that do not match stay where they are.
        """
        deadline = self._now() + timeout
        with nullcontext() if self._arrivals is None else self._arrivals.awaited(), self._arrival:
            while True:
                for index, (_, record) in enumerate(self._rows):
                    if match(record):
                        if take:
                            del self._rows[index]
                        return record
                left = deadline - self._now()
                if left <= 0.0 or not self._open:
                    return None
                self._wait(left)

    def end(self) -> None:
        """No more records will come: whoever waits is woken."""
        with self._arrival:
            self._open = False
            self._arrival.notify_all()

    def _look(self) -> None:
        if self._arrivals is not None:
            self._arrivals.decode()
