"""Lines into a file by a thread of their own: a disk that is full or stuck never holds the control loop."""

from __future__ import annotations

import contextlib
import os
import threading
from queue import Full, Queue
from typing import IO

CAPACITY = 10_000
"""Lines that may wait for a stuck disk; a campaign writes a few a second."""
CLOSE_TIMEOUT = 5.0
"""s that closing waits for a stuck disk."""


class LineWriter:
    """Owns the file. `error` says why lines are lost, once they are; what comes after that is not written."""

    def __init__(self, file: IO[bytes], *, sync: bool, at_once: bool = False) -> None:
        """`sync`: fsync after each line. `at_once`: `write` writes, and there is no thread."""
        self.error = ""
        self._file = file
        self._sync = sync
        self._at_once = at_once
        self._waiting: Queue[bytes | None] = Queue(CAPACITY)
        # a daemon: a disk that never answers must not keep the process alive
        self._thread = threading.Thread(target=self._run, name=f"write {file.name}", daemon=True)
        if not at_once:
            self._thread.start()

    @property
    def settled(self) -> bool:
        """Everything that was handed over is written, or will never be."""
        return bool(self.error) or not self._waiting.unfinished_tasks

    def write(self, line: str) -> None:
        """Hand over one line, without its end. Never raises, and never blocks but where it writes at once."""
        if self._at_once:
            self._keep(line.encode() + b"\n")
        else:
            self._put(line.encode() + b"\n")

    def close(self) -> None:
        """Wait until all is written, then let the file go; a disk that is stuck is left alone after a while."""
        if self._at_once:
            self._let_go()
            return
        with contextlib.suppress(Full):
            self._waiting.put(None, timeout=CLOSE_TIMEOUT)
        self._thread.join(CLOSE_TIMEOUT)

    def _put(self, line: bytes) -> None:
        try:
            self._waiting.put_nowait(line)
        except Full:
            self.error = self.error or f"{self._file.name}: the disk is stuck, {CAPACITY} lines wait for it"

    def _run(self) -> None:
        try:
            while (line := self._waiting.get()) is not None:
                self._keep(line)
                self._waiting.task_done()
            self._waiting.task_done()
        finally:
            self._let_go()

    def _let_go(self) -> None:
        with contextlib.suppress(OSError):  # what it still held is lost, and `error` says why
            self._file.close()

    def _keep(self, line: bytes) -> None:
        if not self.error:
            self._store(line)

    def _store(self, line: bytes) -> None:
        try:
            self._file.write(line)
            self._file.flush()
            if self._sync:
                os.fsync(self._file.fileno())
        except OSError as error:
            self.error = f"{self._file.name} can't be written: {error.strerror or error}"
