"""A process that answers lines with lines, may be killed, and is started again when it is asked the next time."""

from __future__ import annotations

import json
import os
import select
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from time import monotonic
from typing import Any

STOPPING = 5.0
"""s that a process is given to end by itself."""
PIECE = 1 << 16
"""Bytes of an answer that are read at once."""
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


class Overdue(Exception):
    """No line came within the limit; the process was killed."""


class Ended(Exception):
    """The process ended instead of answering."""


class BrokenOff(Exception):
    """The work ends: nothing is asked any more, and what was asked has no answer."""


@dataclass
class Child:
    """A process that answers each line with a line. It is started when first asked, and again after it was killed."""

    command: Sequence[str]
    log: Path
    """Its standard error is added here."""
    process: subprocess.Popen[bytes] | None = None
    dismissed: bool = False
    """It is not asked any more."""
    starting: Lock = field(default_factory=Lock, repr=False)
    """So that none is started while it is dismissed: nobody would end it."""

    def ask(self, line: Mapping[str, Any], limit: float) -> bytes:
        """The line that it answers, with its end.

        Raises Overdue after `limit` s without an answer, Ended when there will be none, BrokenOff when dismissed.
        """
        try:
            return self._ask(line, limit)
        except (Overdue, Ended, OSError, ValueError) as end:  # its pipe may be closed under us
            if self.dismissed:
                raise BrokenOff from end
            raise

    def dismiss(self, patience: float = STOPPING) -> None:
        """End it for good, from any thread."""
        with self.starting:
            self.dismissed = True
        self.close(patience)

    def _ask(self, line: Mapping[str, Any], limit: float) -> bytes:
        process = self._running()
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(json.dumps(line).encode() + b"\n")
            process.stdin.flush()
        except OSError as error:
            raise Ended(self._end()) from error
        end, said = monotonic() + limit, bytearray()
        while not said.endswith(b"\n"):
            ready, _, _ = select.select([process.stdout], [], [], max(end - monotonic(), 0.0))
            if not ready:
                self.close(0.0)
                raise Overdue
            piece = os.read(process.stdout.fileno(), PIECE)
            if not piece:
                raise Ended(self._end())
            said += piece
        return bytes(said)

    def close(self, patience: float = STOPPING) -> None:
        """End it; it is killed when that takes more than `patience` s."""
        process, self.process = self.process, None
        if process is None:
            return
        with suppress(OSError):
            if process.stdin is not None:
                process.stdin.close()
        try:
            process.wait(patience)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if process.stdout is not None:
            process.stdout.close()

    def _running(self) -> subprocess.Popen[bytes]:
        with self.starting:
            if self.dismissed:
                raise BrokenOff
            if self.process is None:
                self.process = self._started()
            return self.process

    def _started(self) -> subprocess.Popen[bytes]:
        with self.log.open("ab") as log:
            return subprocess.Popen(
                self.command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                env={**os.environ, **ONE_THREAD},
                bufsize=0,
                start_new_session=True,  # Ctrl+C in the terminal is for us: its death would be an answer
            )

    def _end(self) -> str:
        process = self.process
        self.close()
        return f"exit status {process.returncode if process else '?'}, see {self.log}"
