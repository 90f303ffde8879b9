"""A run told in lines: events as they come, and a progress bar where there is a terminal; one line per finished step
where there is none, so that a log file stays a log."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import timedelta
from typing import Final

from rich.console import Console
from rich.progress import BarColumn, TextColumn
from rich.progress import Progress as Bar
from rich.style import Style

from rig.link.attention import Bell, wanted_for
from rig.link.front_end_messages import LogLine, Point, Progress, Snapshot, State
from rig.screen_options import Look
from rig.visible_text import console as visible_console

STYLES: Final = {
    "info": Style(),
    "warning": Style(color="yellow"),
    "trip": Style(color="red", bold=True),
    "error": Style(color="red", bold=True),
}

MEASURING: Final[tuple[State, ...]] = ("proving", "tare", "ramp", "hold", "rest", "wait", "sine", "free")
"""States in which a step of the plan is under way."""


@dataclass
class Narration:
    """Writes to `console`; remembers what it has told."""

    console: Console = field(default_factory=lambda: visible_console(stderr=True))
    told: int = 0
    """Log lines written so far, by the controller's count."""
    before: Snapshot | None = None
    bell: Bell | None = field(default_factory=Bell)
    """None: it never rings."""
    _bar: Bar | None = None

    @contextmanager
    def shown(self) -> Iterator[None]:
        """The progress bar is on the terminal, if there is one."""
        if not self.console.is_terminal:
            yield
            return
        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TextColumn("{task.percentage:3.0f} %"),
            TextColumn("{task.fields[left]}", markup=False),
        )
        with Bar(*columns, console=self.console, refresh_per_second=5) as self._bar:
            self._bar.add_task("connecting", total=1.0, left="")
            yield

    def tell(self, snapshot: Snapshot) -> None:
        """What is new in this snapshot."""
        self._events(snapshot)
        if self.console.is_terminal and self.bell is not None and self._rings(self.bell, snapshot):
            self.console.bell()
        if self._bar is None:
            self._finished(snapshot)
        else:
            self._progress(self._bar, snapshot)
        self.before = snapshot

    @staticmethod
    def _rings(bell: Bell, snapshot: Snapshot) -> bool:
        """It starts by itself: that it is ready calls nobody."""
        wanted = wanted_for(snapshot)
        return bell.rings("" if wanted == "ready" else wanted, snapshot.since_begin)

    def say(self, text: str, style: Style | None = None) -> None:
        """One line, however long: a terminal folds it, a log file does not."""
        self.console.print(text, style=style, markup=False, highlight=False, soft_wrap=True)

    def _events(self, snapshot: Snapshot) -> None:
        new = min(snapshot.log_count - self.told, len(snapshot.log))
        self.told = snapshot.log_count
        for line in snapshot.log[len(snapshot.log) - new :]:
            self.say(event_line(line), STYLES[line.level])

    def _progress(self, bar: Bar, snapshot: Snapshot) -> None:
        progress = snapshot.progress
        where = f"{snapshot.thruster} {snapshot.state}".strip()
        if progress is not None:
            if progress.steps:
                where += f" · step {progress.step + 1}/{progress.steps} · {snapshot.command:+.1f} V"
            left = f"about {timedelta(seconds=round(progress.eta))} left"  # by plan: a pause does not make it longer
            bar.update(bar.task_ids[0], completed=progress.fraction, left=left)
        where += f" · {snapshot.reason}" if snapshot.reason else ""
        bar.update(bar.task_ids[0], description=where)

    def _finished(self, snapshot: Snapshot) -> None:
        """A line for the step that was under way in the snapshot before, when it is not any more."""
        before = self.before
        if before is None or before.progress is None or not before.progress.steps or snapshot.progress is None:
            return
        was, now = before.progress, snapshot.progress
        moved = (was.run, was.step) != (now.run, now.step)
        last = snapshot.state not in (*MEASURING, "paused") and snapshot.outcome not in ("aborted", "tripped")
        if before.state in MEASURING and (moved or last):
            self.say(step_line(before, was, snapshot.points))


def narration_of(look: Look) -> Narration:
    """On this terminal."""
    console = visible_console(stderr=True, no_color=True) if look.colors == "none" else visible_console(stderr=True)
    return Narration(console, bell=Bell() if look.bell else None)


def event_line(line: LogLine) -> str:
    """`   12.30 s  warning  text`"""
    return f"{line.time:8.2f} s  {line.level:<7}  {line.text}"


def step_line(done: Snapshot, progress: Progress, points: tuple[Point, ...]) -> str:
    """The step under way in `done`, and the hold it became, if it is one of `points`."""
    text = f"{done.since_begin:8.2f} s  step {progress.step + 1}/{progress.steps}  {done.thruster} {done.state}"
    text += f" {done.command:+.2f} V"
    for point in points:
        if (point.thruster or done.thruster, point.step) == (done.thruster, progress.step):
            text += f": {point.thrust:.3f} ± {point.std_error:.3f} N{'' if point.steady else ', not steady'}"
    return text
