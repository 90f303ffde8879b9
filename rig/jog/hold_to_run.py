"""The front end of a jog: the motor may be driven while a key is held, and is told 0 V when it is let go.

It attends as every front end does: when this process or its terminal is gone, the controller stops the run by itself
(docs/reliability.md). A pause is 0 V at once; a press resumes the step under way from its beginning.
"""

from __future__ import annotations

import os
import select
import signal
import termios
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from rig.jog.held_key import HeldKey
from rig.link.front_end_messages import Request, Snapshot
from rig.link.sockets import Peer
from rig.operate.headless import LEASE_PERIOD, PATIENCE
from rig.operate.narration import STYLES, Narration
from rig.sequence.requests import RUNNING

TURN = 0.05
"""s between two looks at the key."""
AGAIN = 0.3
"""s after which a pause that was not obeyed is asked for again."""
HOLD = b" "
END = (b"q", b"Q", b"\x1b", b"\x03", b"\x04")
"""q, Esc, Ctrl+C, Ctrl+D."""
LET_GO = "0 V: hold SPACE to drive again, q ends"


@dataclass
class HoldToRun:
    """Follows one run to its end."""

    peer: Peer
    terminal: int
    narration: Narration = field(default_factory=lambda: Narration(bell=None))
    """Silent: whoever let go of the key knows that it pauses."""
    clock: Callable[[], float] = time.monotonic
    last: Snapshot | None = None
    _key: HeldKey = field(default_factory=HeldKey)
    _driving: bool = False
    """What was asked for last: the run goes on."""
    _asked_at: float = 0.0
    _leased: float = 0.0
    _told_ready: bool = False
    _failing: float | None = None
    _stopping: str = ""
    """Why the end was asked for."""
    _stop_sent: bool = False
    _mounted: bool = False

    def follow(self) -> Snapshot | None:
        """Until the run is done or the controller is gone; the last snapshot."""
        with self._keys(), self._interrupts():
            while self.turn():
                pass
        return self.last

    def turn(self) -> bool:
        """One look at keys and news; False when there is nothing more to follow."""
        sources: list[Peer | int] = [self.peer, *([self.terminal] if self.terminal >= 0 else [])]
        ready, _, _ = select.select(sources, [], [], TURN)
        if self.terminal in ready:
            self._read_keys()
        for message in self.peer.receive() if self.peer in ready else []:
            if isinstance(message, Snapshot):
                self.last = message
                self.narration.tell(message)
        now = self.clock()
        if self.last is not None and self.last.state != "done":
            self._act(self.last, now)
        if now - self._leased >= LEASE_PERIOD:
            self._leased = now
            self.peer.send(Request("lease"))
        self.peer.flush()
        return not self.peer.closed and not (self.last is not None and self.last.state == "done")

    def _read_keys(self) -> None:
        try:
            data = os.read(self.terminal, 1024)
        except OSError:
            data = b""
        if not data:
            self.terminal = -1
            self._end("its terminal was closed")
        for code in data:
            key = bytes((code,))
            if key == HOLD:
                self._key.pressed(self.clock())
            else:
                self._key.let_go()
                if key in END:
                    self._end("the operator of the jog")

    def _end(self, why: str) -> None:
        self._key.let_go()
        self._stopping = self._stopping or why

    def _act(self, snapshot: Snapshot, now: float) -> None:
        if self._stopping:
            if not self._stop_sent:
                self._stop_sent = True
                self.peer.send(Request("stop", self._stopping))
            return
        down = self._key.down(now)
        if self._driving and not down:
            self._pause(now)
            self.narration.say(LET_GO)
        match snapshot.state:
            case "preflight":
                self._judge(snapshot, down)
            case "mount" if snapshot.mounted_by_hand and not self._mounted:
                self._mounted = True
                self.peer.send(Request("mounted"))
            case "paused" if down and not self._driving and now - self._asked_at > TURN:
                self._driving, self._asked_at = True, now
                self.peer.send(Request("resume"))
            case state if state in RUNNING and not self._driving and now - self._asked_at > AGAIN:
                self._pause(now)  # the one before came when no step was under way

    def _pause(self, now: float) -> None:
        self._driving, self._asked_at = False, now
        self.peer.send(Request("pause"))

    def _judge(self, snapshot: Snapshot, down: bool) -> None:
        """Starts once, when every check has passed and the key is held."""
        failed = "; ".join(f"{check.name}: {check.text}" for check in snapshot.checks if check.verdict == "failed")
        if failed:
            now = self.clock()
            if self._failing is None:
                self._failing = now
                self.narration.say(f"waiting up to {PATIENCE:g} s for {failed}", STYLES["warning"])
            elif now - self._failing > PATIENCE:
                self._end(f"the preflight: {failed}")
            return
        self._failing = None
        if not snapshot.checks or any(check.verdict == "waiting" for check in snapshot.checks):
            return
        if not self._told_ready:
            self._told_ready = True
            self.narration.say(
                "ready: THE PROPELLER TURNS WHILE YOU HOLD SPACE (first the proof of the watchdog, then a tare at rest,"
                " then your voltage); 0 V when you let go; q ends",
                STYLES["trip"],
            )
        if down and not self._driving:
            self._driving, self._asked_at = True, self.clock()
            self.peer.send(Request("start"))

    @contextmanager
    def _keys(self) -> Iterator[None]:
        """Characters as they are typed; what was typed before is for none."""
        if not os.isatty(self.terminal):
            yield
            return
        terminal, before = self.terminal, termios.tcgetattr(self.terminal)
        tty.setcbreak(terminal, termios.TCSAFLUSH)
        try:
            yield
        finally:
            if self.terminal >= 0:
                termios.tcsetattr(terminal, termios.TCSADRAIN, before)

    @contextmanager
    def _interrupts(self) -> Iterator[None]:
        """Ctrl+C ends it in order; the second one leaves, which also stops the run."""

        def first(*_: object) -> None:
            self._end("Ctrl+C in the terminal of the jog")
            signal.signal(signal.SIGINT, signal.default_int_handler)

        before = signal.signal(signal.SIGINT, first)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)
