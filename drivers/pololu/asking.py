"""One question at a time to a device whose answers are bare bytes: when it may be asked, and when it has gone."""

from __future__ import annotations

import threading
from collections import deque

from drivers.pololu.packets import Decoder, Record

PATIENCE_NS = 100_000_000
"""After which an answer is given up."""
UNANSWERED = 3
"""Questions in a row without an answer: the device is gone."""
EARLY = 4
"""A turn that comes by this part of a period too early is one in time."""


class Asking:
    """`feed` is for the thread that reads, everything else for the one that drains."""

    def __init__(self, rate: float) -> None:
        """`rate`: questions/s at most."""
        self._period_ns = round(1e9 / rate)
        self._decoder, self._turn = Decoder(), threading.Lock()
        self._next_ns = self._asked_ns = 0
        self._unanswered = 0
        self._excused = 0
        self._asked: deque[int] = deque()
        """Flags that were excused before each question whose row was not taken yet."""

    def reset(self) -> None:
        self._next_ns = self._asked_ns = self._unanswered = self._excused = 0
        self._asked.clear()
        self.expect(0)

    def feed(self, data: bytes) -> list[Record]:
        with self._turn:
            return self._decoder.feed(data)

    def expect(self, length: int) -> None:
        """From now on `length` bytes are the answer; 0: nothing is."""
        with self._turn:
            self._decoder.expect(length)

    def begin(self, now_ns: int, length: int) -> tuple[bool, str]:
        """Whether it is time to ask for `length` bytes, which then are waited for; and what was given up for it.

        What comes late must not be taken for the next answer: one round is left out.
        """
        if now_ns < self._next_ns - self._period_ns // EARLY:
            return False, ""
        with self._turn:
            if self._decoder.waiting and now_ns - self._asked_ns < PATIENCE_NS:
                return False, ""
            given_up, rest = self._decoder.waiting, self._decoder.expect(0)
            if not given_up:
                self._decoder.expect(length)
        self._next_ns = max(self._next_ns + self._period_ns, now_ns)
        if given_up:
            self._unanswered += 1
            self._excused |= self._asked.pop() if self._asked else 0
            return False, f"no answer within {PATIENCE_NS * 1e-6:.0f} ms, came {rest.hex(' ') or 'nothing'}"
        self._asked_ns = now_ns
        self._asked.append(self._excused)
        self._excused = 0
        return True, ""

    def excuse(self, flags: int) -> None:
        """The next question may be answered with these, and it is no fault: we have caused them."""
        self._excused |= flags

    def answered(self) -> int:
        """A row is taken; which flags are excused in it."""
        self._unanswered = 0
        return self._asked.popleft() if self._asked else 0

    @property
    def gone(self) -> bool:
        """Too many questions in a row had no answer."""
        return self._unanswered >= UNANSWERED
