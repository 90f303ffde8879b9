"""One thread reads every port of the process that has a descriptor, and stamps what comes.

With a thread for each port they take the interpreter from one another and from the control loop: two full buses and
three load cells of 1 kHz took 23 % of a core so, and take 18 (benchmarks/controller/full_buses.py).
"""

from __future__ import annotations

import os
import selectors
import threading
import time
import traceback
from collections.abc import Callable
from typing import Final

from drivers.ports.punctual import on_time
from drivers.ports.wire import Arrived

Lost = Callable[[str], None]
"""Told why nothing will come any more, as one sentence."""

READ_TIMEOUT: Final = 0.05
"""s; how soon an idle reader notices that there is nothing left to read."""
CHUNK: Final = 65_536
"""Bytes taken at once, at most."""


class Port:
    """What is read, and who hears of it."""

    def __init__(self, label: str, arrived: Arrived, lost: Lost) -> None:
        self.label, self.arrived, self.lost = label, arrived, lost
        self.watched = True


class Reader:
    """Watches descriptors from the first that it is given until the last is forgotten, by a thread of its own."""

    def __init__(self) -> None:
        self.begin_anew()

    def begin_anew(self) -> None:
        """In a process that was forked off: the thread, and who held the lock, are in the other."""
        self._lock = threading.RLock()
        """Held while chunks are handed over: who forgets a port waits for that."""
        self._selector: selectors.BaseSelector | None = None
        """Holds what is watched; None: nothing is, and there is no thread."""

    def watch(self, descriptor: int, port: Port) -> None:
        """From now on tell `port` what comes. A read from `descriptor` must never wait."""
        with self._lock:
            if self._selector is None:
                self._selector = selectors.DefaultSelector()
                threading.Thread(target=self._run, args=(self._selector,), name="reader", daemon=False).start()
            self._selector.register(descriptor, selectors.EVENT_READ, port)

    def forget(self, descriptor: int) -> None:
        """After it the port is told nothing. Safe to call twice, and for what was lost."""
        with self._lock:
            if self._selector is not None and descriptor in self._selector.get_map():
                self._selector.unregister(descriptor).data.watched = False

    def _run(self, selector: selectors.BaseSelector) -> None:
        on_time()
        try:
            self._follow(selector)
        finally:
            self._end(selector)

    def _follow(self, selector: selectors.BaseSelector) -> None:
        while True:
            ready = selector.select(READ_TIMEOUT)
            if not ready and not self._is_wanted(selector):
                return
            with self._lock:
                for key, _ in ready:
                    if key.data.watched:  # not forgotten since it was ready
                        self._read(key.fd, key.data)

    def _is_wanted(self, selector: selectors.BaseSelector) -> bool:
        """Whether anything is left to read; when there is not, the next port begins anew."""
        with self._lock:
            if not selector.get_map():
                self._selector = None
            return self._selector is selector

    def _read(self, descriptor: int, port: Port) -> None:
        """Hand over a chunk."""
        try:
            data = os.read(descriptor, CHUNK)
            if not data:
                raise OSError("the device has gone")
            port.arrived(time.monotonic_ns(), data)
        except BlockingIOError:  # woken for nothing
            return
        except OSError as error:
            self.forget(descriptor)
            port.lost(lost_by(port.label, error))
        except Exception:  # noqa: BLE001  of any kind: the other ports are read on
            traceback.print_exc()
            self.forget(descriptor)
            port.lost(stopped(port.label))

    def _end(self, selector: selectors.BaseSelector) -> None:
        """Whatever ended the thread: nobody is left waiting for it."""
        with self._lock:
            for key in list(selector.get_map().values()):
                key.data.lost(stopped(key.data.label))
            selector.close()
            self._selector = None if self._selector is selector else self._selector


def lost_by(label: str, error: Exception) -> str:
    """What is said of a port that went."""
    return f"{label} was lost ({error}): check adapter, cable and power, then open it again"


def stopped(label: str) -> str:
    """What is said where this program is at fault."""
    return f"the reader of {label} stopped on an error of this program (see the log)"


READER: Final = Reader()
"""That of this process."""
os.register_at_fork(after_in_child=READER.begin_anew)
