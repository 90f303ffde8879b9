"""How far a diagnosis is, on one line of a terminal; and Ctrl+C: once it ends the search, twice everything."""

from __future__ import annotations

import shutil
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic
from types import FrameType
from typing import TextIO

from rig.visible_text import unfiltered, visible

ENDED_AT_ONCE = 130
"""Exit status of what Ctrl+C ended: 128 + SIGINT."""
LEAST_WIDTH = 40


class Watching:
    """An observer of a diagnosis (identification.mismatch.observer) that shows it on `out`, where there is one."""

    def __init__(self, out: TextIO | None, now: Callable[[], float] = monotonic) -> None:
        self._out, self._now, self._begun = out, now, now()
        self._stage = ""
        self._asked = False

    def stage(self, name: str) -> None:
        self._stage = name
        self._show(name)

    def trying(self, what: str) -> None:
        if self._asked:
            from identification.mismatch.observer import Interrupted

            raise Interrupted
        self._show(f"{self._stage}: {what}")

    def interrupt(self, signum: int, frame: FrameType | None) -> None:
        """A handler of SIGINT. Raises SystemExit the second time, and where there is no search to end."""
        del signum, frame
        if self._asked or not self._stage:
            self.clear()
            raise SystemExit(ENDED_AT_ONCE)
        self._asked = True
        self._show("ends with what it has; Ctrl+C again ends at once")

    def clear(self) -> None:
        """Nothing of it stays on the terminal."""
        if self._out is not None:
            self._out.write("\r\x1b[K")
            self._out.flush()

    def _show(self, what: str) -> None:
        if self._out is not None:
            wide = max(shutil.get_terminal_size().columns - 1, LEAST_WIDTH)
            self._out.write(f"\r\x1b[K{visible(f'{self._now() - self._begun:4.0f} s  {what}')[:wide]}")
            self._out.flush()


@contextmanager
def observed(*, shown: bool) -> Iterator[Watching]:
    """What watches a diagnosis while Ctrl+C is its; `shown`: on standard error, where that is a terminal."""
    watching = Watching(unfiltered(sys.stderr) if shown and sys.stderr.isatty() else None)
    if threading.current_thread() is not threading.main_thread():  # signals are another's
        yield watching
        return
    before = signal.signal(signal.SIGINT, watching.interrupt)
    try:
        yield watching
    finally:
        signal.signal(signal.SIGINT, before)
        watching.clear()
