"""The controller's side of the recorder process: start it, feed it, know when it is gone or late. Never blocks."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import numpy as np

from drivers.protocols import Sample
from rig.errors import LinkError
from rig.link.recorder_messages import Ack, Close, Closed, EventRow, Failed, Open, Outcome, Ready, Rows, StepRow
from rig.link.sockets import Overrun, Peer, pair

ACK_TIMEOUT = 15.0
"""s without a flush before the recorder counts as gone: above the 10 s stall of docs/reliability.md, promise 18."""
SHUT_DOWN_TIMEOUT = 10.0
"""s for the recorder to close its file after the motor has been stopped."""
RESERVE_BYTES = 64 * 2**20
"""Free disk space below which the run ends in order (docs/reliability.md, promise 17)."""


@dataclass
class RecorderLink:
    """One recorder process; several files one after another."""

    peer: Peer
    process: subprocess.Popen[bytes] | None
    """None: the other end of the link is not a child of ours."""
    streams: tuple[str, ...] = ()
    ready: bool = False
    closed: Closed | None = None
    failed: str = ""
    last_ack: Ack | None = None
    last_heard: float = 0.0
    """Monotonic s of the last message from the recorder while a file is open."""
    unexpected: list[str] = field(default_factory=list)

    @classmethod
    def start(cls, log: IO[bytes]) -> RecorderLink:
        peer, theirs = pair("recorder")
        process = subprocess.Popen(
            [sys.executable, "-m", "rig.recording.recorder", "--fd", str(theirs.fileno())],
            pass_fds=(theirs.fileno(),),
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )
        theirs.close()
        return cls(peer, process)

    def open(self, request: Open, now: float) -> None:
        """Ask for a new file; `ready` turns true once it exists with its whole layout."""
        self.streams = tuple(stream.name for stream in request.streams)
        self.ready, self.closed, self.failed, self.last_ack, self.last_heard = False, None, "", None, now
        self._send(request)

    def rows(self, samples: Iterable[Sample]) -> None:
        """Hand over what one tick drained, one binary message per stream."""
        grouped: dict[str, list[Sample]] = {}
        for sample in samples:
            grouped.setdefault(sample.stream, []).append(sample)
        for stream, rows in grouped.items():
            self._send(_rows(self.streams.index(stream), rows))

    def step(self, row: StepRow) -> None:
        self._send(row)

    def event(self, row: EventRow) -> None:
        self._send(row)

    def close_file(self, outcome: Outcome, cause: str) -> None:
        """Close in order; `closed` holds path and hash once it is done."""
        self._send(Close(outcome, cause))

    def poll(self, now: float) -> None:
        """Take what the recorder said."""
        if self.failed:
            return
        try:
            messages = self.peer.receive()
            self.peer.flush()
        except LinkError as error:
            self.failed = str(error)
            return
        for message in messages:
            self.last_heard = now
            match message:
                case Ready():
                    self.ready = True
                case Ack():
                    self.last_ack = message
                case Closed():
                    self.closed, self.ready = message, False
                case Failed(text=text):
                    self.failed = text
                case _:
                    self.failed = f"the recorder sent a {type(message).__name__}, which only the controller sends"
        if self.peer.closed and not self.failed:
            self.failed = "the recorder process has ended"

    def trouble(self, now: float) -> str | None:
        """Why recording can't be trusted now, as a sentence; None while all is well."""
        if self.failed:
            return f"recorder: {self.failed}"
        if self.ready and now - self.last_heard > ACK_TIMEOUT:
            return f"recorder: nothing was flushed for {now - self.last_heard:.0f} s; its disk may be stuck"
        if self.ready and self.last_ack is not None and self.last_ack.free_bytes < RESERVE_BYTES:
            left = self.last_ack.free_bytes / 2**20
            return f"recorder: only {left:.0f} MiB left on the disk; the run ends while the file can still be closed"
        return None

    def shut_down(self) -> None:
        """Let the link go: the recorder closes what is open and ends. Waits for that; a stuck disk is left alone."""
        self.peer.close()
        if self.process is not None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(SHUT_DOWN_TIMEOUT)

    def _send(self, message: Open | Rows | StepRow | EventRow | Close) -> None:
        if self.failed:
            return
        try:
            self.peer.send(message)
        except Overrun as error:
            self.failed = f"recorder overrun: {error}"


def _rows(stream: int, samples: Sequence[Sample]) -> Rows:
    t_ns = np.fromiter((sample.t_ns for sample in samples), np.int64, len(samples))
    return Rows(stream, t_ns, np.array([sample.values for sample in samples], dtype=np.float64))


def recording_path(folder: Path, thruster: str) -> Path:
    """`<folder>/<thruster>.h5`, or `<thruster>-2.h5` ... when it is there: a recording is never overwritten."""
    path = folder / f"{thruster}.h5"
    number = 1
    while path.exists():
        number += 1
        path = folder / f"{thruster}-{number}.h5"
    return path
