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
from rig.names import file_inside

SHUT_DOWN_TIMEOUT = 10.0
"""s for the recorder to close its file after the motor has been stopped."""


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

    def silence(self, now: float) -> float:
        """S since the recorder was last heard of while it has a file open; 0 while it has none."""
        return now - self.last_heard if self.ready else 0.0

    @property
    def free_bytes(self) -> int | None:
        """On the disk of the open file at its last flush; None: no file is open, or nothing was flushed yet."""
        return self.last_ack.free_bytes if self.ready and self.last_ack is not None else None

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
    """`<folder>/<thruster>.h5`, or `<thruster>-2.h5` ... when it is there: a recording is never overwritten.

    Raises RecordingError for a thruster whose name would lead out of the folder.
    """
    path = file_inside(folder, thruster, ".h5")
    number = 1
    while path.exists():
        number += 1
        path = file_inside(folder, thruster, f"-{number}.h5")
    return path
