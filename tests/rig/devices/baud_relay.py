"""A line that has a baud rate: what passes at another one is garbled, as a receiver that samples too fast or slowly."""

from __future__ import annotations

import contextlib
import os
import select
import termios
import threading
import tty
from pathlib import Path
from types import TracebackType


class BaudRelay:
    """Between the port `far` of a simulated device and the one that the rig opens, `port`. The device is at `baud`."""

    def __init__(self, far: Path, baud: int) -> None:
        self._speed = getattr(termios, f"B{baud}")
        self._far = os.open(far, os.O_RDWR | os.O_NOCTTY)
        self._near, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="baud relay")

    def __enter__(self) -> BaudRelay:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop.set()
        self._thread.join()
        for each in (self._far, self._near, self._slave):
            os.close(each)

    def _run(self) -> None:
        ways = {self._near: self._far, self._far: self._near}
        while not self._stop.is_set():
            for source in select.select(list(ways), [], [], 0.02)[0]:
                with contextlib.suppress(OSError):
                    data = os.read(source, 4096)
                    os.write(ways[source], data if self._at_the_rate() else bytes(map(garbled, data)))

    def _at_the_rate(self) -> bool:
        return termios.tcgetattr(self._slave)[4] == self._speed


def garbled(byte: int) -> int:
    """Start bit and data sampled at twice their pace: each bit seen twice, the rest lost."""
    bits = [0, *(byte >> n & 1 for n in range(8)), 1]
    return sum(bits[(n + 1) // 2] << n for n in range(8)) | 0x80
