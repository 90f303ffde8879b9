"""A thread of its own for a port that has no descriptor: pyserial's loop:// and rfc2217://, python-can's adapters."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Final

from drivers.ports.punctual import on_time
from drivers.ports.reader import Lost, lost_by, stopped

JOIN_TIMEOUT: Final = 2.0
"""s; forty times what a reader needs to stop."""


class OwnReader:
    """Calls `look`, which waits for at most some 50 ms, until it is told to end or the port is lost."""

    def __init__(self, label: str, look: Callable[[], None], lost: Lost, losing: tuple[type[Exception], ...]) -> None:
        """`losing`: the errors by which `look` tells that the port has gone."""
        self._label, self._look, self._lost, self._losing = label, look, lost, losing
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"read {label}", daemon=False)
        self._thread.start()

    def end(self) -> None:
        """Wait for the thread."""
        self._ending.set()
        self._thread.join(JOIN_TIMEOUT)

    def _run(self) -> None:
        on_time()
        why = stopped(self._label)
        try:
            while not self._ending.is_set():
                self._look()
            why = ""
        except self._losing as error:
            why = lost_by(self._label, error)
        finally:
            if why:
                self._lost(why)
