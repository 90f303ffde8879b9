"""Bytes as they came, with their stamps, between the thread that reads a wire and whoever wants to know what they say.

The reader only stamps: a full bus wakes it a thousand times a second, and what it does then it does with a cold cache
and against the control loop. The loop decodes when it drains, all at once, for half the price
(benchmarks/controller/full_buses.py). While somebody waits for an answer the reader decodes at once.
"""

from __future__ import annotations

import threading
import traceback
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

Chunk = tuple[int, bytes]
"""When it came (ns), and what."""
MOST = 64
"""Chunks that are kept; a reader that finds so many decodes them itself, so that memory is bounded without a drain."""


class Arrivals:
    """One thread adds, any may decode; each chunk is decoded once, in the order in which they came."""

    def __init__(self, decode: Callable[[list[Chunk]], None], failed: Callable[[], None]) -> None:
        """`decode`: chunks in their order. `failed`: told when that raises, which is an error of this program: the wire
        is lost by it, and nothing that comes is decoded any more."""
        self._decode, self._failed = decode, failed
        self._chunks: deque[Chunk] = deque()
        self._lock = threading.Lock()
        self._waiting = 0
        self._broken = False

    def add(self, t_ns: int, data: bytes) -> None:
        """What came at `t_ns`."""
        self._chunks.append((t_ns, data))
        if self._waiting or len(self._chunks) >= MOST:
            self.decode()

    def decode(self) -> None:
        """All that has come."""
        if not self._chunks:
            return
        with self._lock:
            chunks = [self._chunks.popleft() for _ in range(len(self._chunks))]  # the reader may add meanwhile
            if self._broken or not chunks:
                return
            try:
                self._decode(chunks)
            except Exception:  # noqa: BLE001  of any kind: it must not end the loop that drains
                self._broken = True
                traceback.print_exc()
                self._failed()

    @contextmanager
    def awaited(self) -> Iterator[None]:
        """What comes meanwhile is decoded as it comes; what has come is."""
        with self._lock:
            self._waiting += 1
        try:
            self.decode()
            yield
        finally:
            with self._lock:
                self._waiting -= 1
