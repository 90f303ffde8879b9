"""The controller's side of the watcher process: start it, feed it, hear what it says. Never blocks, and never stops a
run by its own trouble: a run that is not watched is said to be so, once, and goes on.
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import IO

import numpy as np

from drivers.protocols import Sample, Stream
from rig.campaign.bench import COMMAND_STREAM
from rig.campaign.config import CampaignConfig, twin_path
from rig.errors import LinkError
from rig.link.recorder_messages import Failed, Rows
from rig.link.sockets import Overrun, Peer, pair
from rig.link.watch_messages import Judged, Mismatch, Watched, WatchedStream

PERIOD = 0.25
"""s of rows sent at once: the control loop pays for four messages a second and not for hundreds."""
BOUND = 8 * 2**20
"""Bytes that may wait for a watcher that does not read: minutes of rows."""
SHUT_DOWN_TIMEOUT = 2.0
"""s for the watcher to end by itself."""
QUANTITIES = ("command_voltage", "thrust", "bus_voltage", "flow_speed", "rotation_rate")
"""What is looked at."""


@dataclass
class WatchLink:
    """One watcher process; several runs one after another."""

    peer: Peer
    process: subprocess.Popen[bytes] | None
    """None: the other end of the link is not a child of ours."""
    failed: str = ""
    """Why the run is not watched; empty while it is."""
    t0_ns: int | None = None
    """Of the run that is watched; None between runs."""
    judged: Judged | None = None
    """How the run stood when it was last looked at; None: not yet."""
    _places: dict[str, int] = field(default_factory=dict)
    """Stream -> its index in the watcher's messages; empty between runs."""
    _waiting: dict[str, list[Sample]] = field(default_factory=dict)
    _sent: float = 0.0

    @classmethod
    def start(cls, log: IO[bytes]) -> WatchLink:
        peer, theirs = pair("watcher", BOUND)
        process = subprocess.Popen(
            [sys.executable, "-m", "rig.watch.watcher", "--fd", str(theirs.fileno())],
            pass_fds=(theirs.fileno(),),
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )
        theirs.close()
        return cls(peer, process)

    def begin(self, run: Watched) -> None:
        """A run begins: what was learnt of the one before is forgotten."""
        self.failed = "" if not self.peer.closed else self.failed
        self.t0_ns = run.t0_ns
        self.judged = None
        self._places = {stream.name: index for index, stream in enumerate(run.streams)}
        self._waiting.clear()
        self._send(run)

    def end(self) -> None:
        """The run is over: nothing more is fed than what waits."""
        self.flush(self._sent)
        self.t0_ns = None
        self._places.clear()

    def rows(self, samples: Iterable[Sample], now: float) -> None:
        """What one tick drained; goes out every PERIOD s (`now`, s)."""
        for sample in samples:
            if sample.stream in self._places:
                self._waiting.setdefault(sample.stream, []).append(sample)
        if now - self._sent >= PERIOD:
            self.flush(now)

    def flush(self, now: float) -> None:
        """Send what waits, the command first: the samples that follow are cut at it."""
        self._sent = now
        for stream in sorted(self._waiting, key=lambda name: name != COMMAND_STREAM):
            rows = self._waiting[stream]
            t_ns = np.fromiter((row.t_ns for row in rows), np.int64, len(rows))
            self._send(Rows(self._places[stream], t_ns, np.array([row.values for row in rows], dtype=np.float64)))
        self._waiting.clear()

    def heard(self) -> list[Mismatch]:
        """What the watcher has said since; sets `failed` when it is gone."""
        if self.failed:
            return []
        try:
            messages = self.peer.receive()
            self.peer.flush()
        except LinkError as error:
            self.failed = str(error)
            return []
        for message in messages:
            if isinstance(message, Failed):
                self.failed = message.text
            elif isinstance(message, Judged) and message.t0_ns == self.t0_ns:
                self.judged = message
        if self.peer.closed and not self.failed:
            self.failed = "the watcher process has ended; its log is watcher.log in the campaign's folder"
        return [message for message in messages if isinstance(message, Mismatch)]

    def shut_down(self) -> None:
        self.peer.close()
        if self.process is not None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(SHUT_DOWN_TIMEOUT)
            self.process.kill()
            self.process.wait()

    def _send(self, message: Watched | Rows) -> None:
        if self.failed:
            return
        try:
            self.peer.send(message)
        except Overrun as error:
            self.failed = str(error)


def run_of(campaign: CampaignConfig, streams: Mapping[str, Stream], thrust: str, thruster: str, t0_ns: int) -> Watched:
    """What is watched in one run. `thrust`: `<stream>.<channel>` of the modelled force."""
    found = []
    seen: set[str] = set()
    for name, stream in streams.items():
        columns = []
        for column, channel in enumerate(stream.channels):
            quantity = channel.quantity or ""
            taken = f"{name}.{channel.name}" == thrust if quantity == "thrust" else quantity not in seen
            if quantity in QUANTITIES and taken:
                seen.add(quantity)
                columns.append((column, quantity))
        if columns:
            found.append(WatchedStream(name, tuple(columns)))
    found.append(WatchedStream(COMMAND_STREAM, ((0, "command_voltage"),)))
    watch = campaign.watch
    return Watched(
        thruster=thruster,
        t0_ns=t0_ns,
        streams=tuple(found),
        highest=max(campaign.plan.peak(), 1e-3),
        false_alarms_per_hour=watch.false_alarms_per_hour,
        twin=twin_path(watch.twin, thruster),
    )
