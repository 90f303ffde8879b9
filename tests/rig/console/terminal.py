"""A process on a terminal of its own, as an operator has it: keys go in, what is drawn comes out, the line can drop."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import struct
import subprocess
import sys
import termios
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[3]
PATIENCE = 40.0
"""s until something must have been drawn, on a busy machine."""
TAKE_THE_TERMINAL = "import fcntl, sys, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); "


class Terminal:
    """Our end of a pty: reads all that is drawn, in a thread, until the process ends or we hang up."""

    def __init__(self, columns: int = 80, rows: int = 24) -> None:
        self.master, self.slave = pty.openpty()
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        self._seen = bytearray()
        self._news = threading.Condition()
        self._hung_up = threading.Event()

    def follow(self, process: subprocess.Popen[bytes]) -> None:
        """Read what `process` draws."""
        self.reader = threading.Thread(target=self._read, args=(process,))
        self.reader.start()

    def _read(self, process: subprocess.Popen[bytes]) -> None:
        while process.poll() is None and not self._hung_up.is_set():
            if not select.select([self.master], [], [], 0.05)[0]:
                continue
            try:
                data = os.read(self.master, 65536)
            except OSError:  # EIO: nobody has the other side open any more
                return
            with self._news:
                self._seen += data
                self._news.notify_all()

    def until(self, text: bytes) -> None:
        """Wait until `text` has been drawn."""
        with self._news:
            assert self._news.wait_for(lambda: text in self._seen, PATIENCE), bytes(self._seen[-5000:])

    def press(self, keys: bytes) -> None:
        """As the terminal sends them: F5 is ESC [ 15 ~."""
        os.write(self.master, keys)

    def close(self) -> None:
        """Hang up: the process finds its terminal gone. Safe to call twice."""
        if self.master >= 0:
            self._hung_up.set()
            self.reader.join()
            os.close(self.master)
            self.master = -1

    @property
    def lines(self) -> str:
        """All that has been written so far, escape sequences included."""
        with self._news:
            return self._seen.decode(errors="replace")


@contextmanager
def on_terminal(
    code: str, *arguments: str, leading: bool = True, size: tuple[int, int] = (80, 24)
) -> Iterator[tuple[subprocess.Popen[bytes], Terminal]]:
    """Python `code` in a process whose controlling terminal is ours, of `size` columns and rows. Leaving waits for its
    end, and at last kills.

    Not `leading`: the terminal is not its session's, and the kernel tells it of no hang-up.
    """
    terminal = Terminal(*size)
    process = subprocess.Popen(
        [sys.executable, "-c", (TAKE_THE_TERMINAL if leading else "") + code, *arguments],
        stdin=terminal.slave,
        stdout=terminal.slave,
        stderr=terminal.slave,
        start_new_session=True,
        cwd=ROOT,
    )
    os.close(terminal.slave)
    terminal.follow(process)
    try:
        yield process, terminal
        process.wait(20.0)
    finally:
        process.kill()
        process.wait()
        terminal.close()
