"""The front end without a screen: a progress bar over the console's link. It attends: if it dies, the run stops."""

from __future__ import annotations

import os
import select
import signal
import sys
import termios
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from rig.errors import LinkError
from rig.link.front_end_messages import Request, Snapshot
from rig.link.sockets import Peer
from rig.operate.narration import STYLES, Narration

LEASE_PERIOD = 0.5
"""s between leases; the controller lets one hold 2 s."""
SILENCE = 10
"""Lease periods without a snapshot (they come at 10 Hz) after which the controller counts as hung: 5 s."""
PATIENCE = 10.0
"""s that a check may stay failed before it is given up: a device is tried again every 3 s, a rotor comes to rest."""
CTRL_C = "Ctrl+C in the terminal of the progress bar"


@dataclass
class Headless:
    """Follows a run to its end; with `start` it starts the run when the preflight has passed."""

    peer: Peer
    narration: Narration = field(default_factory=Narration)
    terminal: int | None = None
    """File descriptor on which an operator presses Enter; None: nobody is there."""
    last: Snapshot | None = None
    _asked: set[str] = field(default_factory=set)
    _prompted: str = ""
    """Thruster that the operator was asked to put on the bench."""
    _failing: float | None = None
    """s (monotonic) since when a check of the preflight has failed; None: none has."""
    _silent: int = 0
    """Lease periods without a snapshot, in a row."""
    _interrupted: bool = False
    _sending: bool = False

    def follow(self, start: bool) -> Snapshot | None:
        """Show progress until the campaign is done or the controller is gone; returns the last snapshot."""
        with self._interrupts(), self.narration.shown():
            while self._listen():
                if self.last is not None:
                    self.narration.tell(self.last)
                    self._answer(self.last, start)
                    if self.last.state == "done":
                        break
                self._send(Request("lease"))
        return self.last

    def _listen(self) -> bool:
        """Wait for the next lease period, or less when there are news; False when the controller is gone."""
        sources: list[Peer | int] = [self.peer]
        if self._prompted and self.terminal is not None:
            sources.append(self.terminal)
        ready, _, _ = select.select(sources, [], [], LEASE_PERIOD)
        if self.terminal in ready:
            self._enter()
        self._hear(self.peer in ready)
        with self._alone():
            for message in self.peer.receive() if self.peer in ready else []:
                if isinstance(message, Snapshot):
                    self.last = message
            self.peer.flush()
        return not self.peer.closed

    def _hear(self, news: bool) -> None:
        """Say once that nothing comes any more."""
        self._silent = 0 if news else self._silent + 1
        if self._silent == SILENCE:
            seconds = SILENCE * LEASE_PERIOD
            self.narration.say(
                f"no news from the controller for {seconds:g} s: the motor's own watchdog stops it, "
                "look at the propeller; Ctrl+C leaves",
                STYLES["error"],
            )

    def _answer(self, snapshot: Snapshot, start: bool) -> None:
        if self._interrupted:
            self._ask(Request("stop", CTRL_C))
        elif snapshot.state == "preflight" and start:
            self._judge(snapshot)
        elif snapshot.state == "mount" and snapshot.mounted_by_hand:
            self._mount(snapshot)
        else:
            self._prompted = ""

    def _judge(self, snapshot: Snapshot) -> None:
        """Start when every check has passed, give up when one stays failed."""
        failed = "; ".join(f"{check.name}: {check.text}" for check in snapshot.checks if check.verdict == "failed")
        if failed:
            self._wait_or_give_up(failed)
            return
        self._failing = None
        if all(check.verdict in ("passed", "warning") for check in snapshot.checks):
            self._ask(Request("start"))

    def _wait_or_give_up(self, failed: str) -> None:
        now = time.monotonic()
        if self._failing is None:
            self._failing = now
            self.narration.say(f"waiting up to {PATIENCE:g} s for {failed}", STYLES["warning"])
        elif now - self._failing > PATIENCE:
            self._ask(Request("stop", f"the preflight: {failed}"))

    def _mount(self, snapshot: Snapshot) -> None:
        """Ask the operator once per thruster; with nobody to ask, one thruster alone is the one on the bench."""
        if self.terminal is not None and self._prompted != snapshot.thruster:
            self._prompted = snapshot.thruster
            termios.tcflush(self.terminal, termios.TCIFLUSH)  # an Enter from before the question is no answer to it
            self.narration.say(f"put {snapshot.thruster} on the bench, then press Enter: the motor turns after that")
        elif self.terminal is None and snapshot.progress is not None and snapshot.progress.runs == 1:
            self._ask(Request("mounted"))

    def _enter(self) -> None:
        """A line from the operator; the end of his terminal is the end of the run."""
        line = os.read(self.terminal, 1024) if self.terminal is not None else b""
        if line:
            self._send(Request("mounted"))
        else:
            self.terminal = None
            self._ask(Request("stop", "the terminal of the progress bar was closed"))

    def _ask(self, request: Request) -> None:
        """Once only."""
        if request.kind not in self._asked:
            self._asked.add(request.kind)
            self._send(request)

    def _send(self, request: Request) -> None:
        with self._alone():
            self.peer.send(request)

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """While the peer is in use here, a signal handler may not use it: two frames would be torn."""
        self._sending = True
        try:
            yield
        finally:
            self._sending = False

    @contextmanager
    def _interrupts(self) -> Iterator[None]:
        """Ctrl+C asks for a stop and stays to see it confirmed; the second one leaves, which also stops the run."""

        def first(*_: object) -> None:
            self._interrupted = True
            signal.signal(signal.SIGINT, signal.default_int_handler)
            if not self._sending:  # else `_answer` sends it, before the next wait for news is over
                self.peer.send(Request("stop", CTRL_C))

        before = signal.signal(signal.SIGINT, first)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)


def operator_terminal() -> int | None:
    """Standard input where a person may press Enter; None in a pipe or a batch job."""
    return sys.stdin.fileno() if sys.stdin.isatty() else None


def check_alive(snapshot: Snapshot | None) -> Snapshot:
    """The last snapshot, or the error that there was none."""
    if snapshot is None:
        raise LinkError(
            "the controller ended before it said anything; its log is controller.log in the campaign's folder"
        )
    return snapshot
