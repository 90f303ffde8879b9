"""The front end without a screen: a progress bar over the same link as the console. It attends: if it dies, the run stops."""

from __future__ import annotations

import select
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from rig.errors import LinkError
from rig.link import Peer
from rig.messages import Request, Snapshot

LEASE_PERIOD = 0.5
"""s between leases; the controller lets one hold 2 s."""
SILENCE = 5.0
"""s without a snapshot (they come at 10 Hz) after which the controller counts as hung."""


@dataclass
class Headless:
    """Follows a run to its end; starts it when the preflight has passed."""

    peer: Peer
    console: Console
    shown: int = 0
    """Log lines printed so far."""
    asked: set[str] = field(default_factory=set)
    interrupted: bool = False
    last: Snapshot | None = None

    def follow(self, start: bool) -> Snapshot | None:
        """Show progress until the campaign is done or the controller is gone; returns the last snapshot."""
        with self._interrupts(), self._bar() as bar:
            task = bar.add_task("connecting", total=1.0)
            while self._listen():
                if self.last is not None:
                    self._show(bar, task, self.last)
                    self._answer(self.last, start)
                    if self.last.state == "done":
                        break
                self.peer.send(Request("lease"))
        return self.last

    def _listen(self) -> bool:
        """Wait for the next lease period, or less when there are news; False when the controller is gone."""
        ready, _, _ = select.select([self.peer], [], [], LEASE_PERIOD)
        for message in self.peer.receive() if ready else []:
            if isinstance(message, Snapshot):
                self.last = message
        self.peer.flush()
        return not self.peer.closed

    def _answer(self, snapshot: Snapshot, start: bool) -> None:
        if self.interrupted:
            self._ask("stop", "Ctrl+C in the terminal of the progress bar")
        elif (
            snapshot.state == "preflight" and start and all(c.verdict in ("passed", "warning") for c in snapshot.checks)
        ):
            self._ask("start")
        elif (
            snapshot.state == "preflight"
            and start
            and (failed := [c for c in snapshot.checks if c.verdict == "failed"])
        ):
            self._ask("stop", "the preflight: " + "; ".join(f"{c.name}: {c.text}" for c in failed))

    def _ask(self, kind: str, text: str = "") -> None:
        if kind in self.asked:
            return
        self.asked.add(kind)
        self.peer.send(Request("stop", text) if kind == "stop" else Request("start"))

    def _show(self, bar: Progress, task: TaskID, snapshot: Snapshot) -> None:
        progress = snapshot.progress
        where = f"{snapshot.thruster} {snapshot.state}".strip()
        if progress is not None:
            where += f" · step {progress.step + 1}/{progress.steps} · {snapshot.command:+.1f} V"
            bar.update(task, completed=progress.fraction)
        bar.update(task, description=where)
        news = snapshot.log_count - self.shown
        for line in snapshot.log[max(len(snapshot.log) - news, 0) :] if news else ():
            style = {"info": "", "warning": "yellow", "trip": "bold red", "error": "bold red"}[line.level]
            bar.console.print(f"{line.time:8.2f} s  {line.level:<7} {line.text}", style=style, highlight=False)
        self.shown = snapshot.log_count

    def _bar(self) -> Progress:
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.percentage:3.0f} %"),
            TimeRemainingColumn(),
        )
        return Progress(*columns, console=self.console, refresh_per_second=5)

    @contextmanager
    def _interrupts(self) -> Iterator[None]:
        """Ctrl+C asks for a stop and stays to see it confirmed; the second one leaves, which also stops the run."""

        def first(*_: object) -> None:
            self.interrupted = True
            self.peer.send(Request("stop", "Ctrl+C in the terminal of the progress bar"))
            signal.signal(signal.SIGINT, signal.default_int_handler)

        before = signal.signal(signal.SIGINT, first)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)


def check_alive(snapshot: Snapshot | None) -> Snapshot:
    """The last snapshot, or the error that there was none."""
    if snapshot is None:
        raise LinkError(
            "the controller ended before it said anything; its log is controller.log in the campaign's folder"
        )
    return snapshot
