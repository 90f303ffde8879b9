"""Main of the recorder process, which owns the file: `python -m rig.recording.recorder --fd N`.

N is an inherited connected socket. HDF5 crashes its process on a full disk, so nothing here may matter to the motor.
The process ends when its link ends; a controller that died leaves a recording that is closed in order and says so.
"""

from __future__ import annotations

import argparse
import hashlib
import logging
import os
import select
import shutil
import signal
import socket
import sys
import time
from collections.abc import Callable
from pathlib import Path

from rig.errors import RecordingError, RigError
from rig.hdf5.layout import FLUSH_PERIOD
from rig.hdf5.write import RecordingFile
from rig.link.framing import Message
from rig.link.recorder_messages import Ack, Close, Closed, EventRow, Failed, Open, Ready, Rows, StepRow
from rig.link.sockets import Peer

ABANDONED = "controller process ended without closing the recording"
FAREWELL = 2.0
"""s for the last message to reach a slow controller."""


class Recorder:
    """One link, several files one after another."""

    def __init__(self, peer: Peer, now_ns: Callable[[], int] = time.monotonic_ns) -> None:
        """`now_ns`: the clock of what comes over the link."""
        self._peer = peer
        self._now_ns = now_ns
        self._file: RecordingFile | None = None
        self._t0_ns = 0
        self._due = 0.0

    def run(self) -> None:
        """Until the link ends. Raises RigError for what is no order to a recorder, and whatever h5py raises."""
        try:
            self._serve()
        except RigError as error:
            if self._file is not None:
                self._file.close("aborted", str(error), self._seconds())
            raise

    def _serve(self) -> None:
        while not self._peer.closed:
            self._wait()
            self.turn()

    def turn(self) -> None:
        """Take what has come, write it when that is due; an end of the link closes the file. Never waits."""
        for message in self._peer.receive():
            self._take(message)
        if self._file is not None and self._now() >= self._due:
            self._flush(self._file)
        if self._peer.closed and self._file is not None:
            self._abandon(self._file)

    def _now(self) -> float:
        return self._now_ns() * 1e-9

    def _wait(self) -> None:
        timeout = max(self._due - self._now(), 0.0) if self._file else None
        writing = [self._peer] if self._peer.waiting else []
        select.select([self._peer], writing, [], timeout)
        self._peer.flush()

    def _take(self, message: Message) -> None:
        match message:
            case Open():
                self._open(message)
            case Rows():
                self._opened(message).add_rows(message)
            case StepRow():
                self._opened(message).add_step(message)
            case EventRow():
                self._opened(message).add_event(message)
            case Close(outcome=outcome, cause=cause):
                self._close(self._opened(message), outcome, cause)
            case _:
                raise RecordingError(f"the controller sent a {type(message).__name__}, which a recorder does not take")

    def _opened(self, message: Message) -> RecordingFile:
        if self._file is None:
            raise RecordingError(f"a {type(message).__name__} came while no recording was open")
        return self._file

    def _open(self, request: Open) -> None:
        if self._file is not None:
            raise RecordingError(f"asked to open {request.path} while {self._file.path} is open; close that first")
        try:
            path = Path(request.path)
            _check_space(path.parent, request.expected_bytes)
            self._file = RecordingFile(path, request.attributes, request.streams, request.t0_ns)
        except (RigError, OSError) as error:
            self._peer.send(Failed(str(error)))
            return
        self._t0_ns = request.t0_ns
        self._due = self._now() + FLUSH_PERIOD
        self._peer.send(Ready(request.path))

    def _flush(self, file: RecordingFile) -> None:
        rows = file.flush()
        self._due = self._now() + FLUSH_PERIOD
        self._peer.send(Ack(rows, self._seconds(), shutil.disk_usage(file.path.parent).free))

    def _close(self, file: RecordingFile, outcome: str, cause: str) -> None:
        file.close(outcome, cause, self._seconds())
        self._file = None
        self._peer.send(Closed(str(file.path), sha256_of(file.path)))

    def _abandon(self, file: RecordingFile) -> None:
        if self._peer.unfinished:
            text = f"the link ended within a message: {self._peer.unfinished} bytes of it came and are lost"
            file.add_event(EventRow(self._seconds(), "error", text))
        file.add_event(EventRow(self._seconds(), "error", ABANDONED))
        file.close("aborted", ABANDONED, self._seconds())
        self._file = None

    def _seconds(self) -> float:
        return (self._now_ns() - self._t0_ns) * 1e-9


def _check_space(folder: Path, expected_bytes: int) -> None:
    if not folder.is_dir():
        raise RecordingError(f"{folder} is not a folder; make it, or change `output` of the campaign")
    free = shutil.disk_usage(folder).free
    if free < 2 * expected_bytes:
        raise RecordingError(
            f"{folder} has {free / 2**20:.0f} MiB free; the plan needs about {expected_bytes / 2**20:.0f} MiB, "
            "and twice that must be free; make room or record elsewhere"
        )


def sha256_of(path: Path) -> str:
    """Hexadecimal digest of a file, read in pieces."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _say_farewell(peer: Peer, text: str) -> None:
    """The last message, waited for: a `Failed` that nobody reads is no message."""
    end = time.monotonic() + FAREWELL
    peer.send(Failed(text))
    while peer.waiting and time.monotonic() < end:
        select.select([], [peer], [], max(end - time.monotonic(), 0.0))
        peer.flush()


def main(arguments: list[str] | None = None) -> int:
    """Exit status: 0 the link ended in order; 3 the file could not be written on."""
    parser = argparse.ArgumentParser(prog="python -m rig.recording.recorder", description=__doc__)
    parser.add_argument("--fd", type=int, required=True, help="inherited file descriptor of a connected AF_UNIX socket")
    fd = parser.parse_args(arguments).fd
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # the controller owns this life
    peer = Peer(socket.socket(fileno=fd), "controller")
    try:
        Recorder(peer).run()
    except Exception as error:  # the top of a process: a full disk is OSError, RuntimeError or ValueError in h5py
        logging.exception("the recorder ends")
        _say_farewell(peer, f"{type(error).__name__}: {error}")
        os._exit(3)  # closing the file would crash in HDF5 (measured); what was flushed is on the disk
    return 0


if __name__ == "__main__":
    sys.exit(main())
