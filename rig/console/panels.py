"""The widgets that show a view. None of them knows the feed; each draws again only when its text has changed."""

from __future__ import annotations

from collections.abc import Hashable

from rich.console import Group
from rich.table import Table
from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.events import Resize
from textual.widgets import RichLog, Static

from rig.console.titles import entitle
from rig.console.view_model import wording
from rig.console.view_model.alarms import alarm
from rig.console.view_model.log_filter import BEFORE, TITLES, LogFilter, run_of, wanted
from rig.console.view_model.running_diagnosis import standing
from rig.console.view_model.tables import (
    checks_table,
    misfits,
    readings_text,
    refusal,
    results_table,
    verdict_summary,
)
from rig.console.view_model.view import View
from rig.link.front_end_messages import LogLine, Snapshot

LOG_STYLES = {"info": "", "warning": "#f0c040", "trip": "bold #ff6070", "error": "bold #ff6070"}
LOG_WORDS = {"info": "     ", "warning": "WARN ", "trip": "TRIP ", "error": "ERROR"}


class Panel(Static):
    """A Static that remembers what it shows."""

    shown: Hashable = None
    lines: int | None = None
    """Of a text that is never wrapped; None: whatever it is, it may come to need another height."""

    def put(self, made_of: Hashable, renderable: Text | Group) -> None:
        """Show `renderable` unless it was made of the same as what is on the screen."""
        if made_of == self.shown:
            return
        self.shown = made_of
        before, self.lines = self.lines, _lines_of(renderable)
        self.update(renderable, layout=self.lines is None or self.lines != before)


def _lines_of(renderable: Text | Group) -> int | None:
    return renderable.plain.count("\n") if isinstance(renderable, Text) and renderable.no_wrap else None


class StopKey(Static):
    """The labelled stop key. A click on it is the key."""

    async def on_click(self) -> None:
        await self.run_action("app.stop")


class Head(Vertical):
    """On every screen and every dialog: the stop key, what the bench does, whether it is the present, and the alarm."""

    def compose(self) -> ComposeResult:
        with Horizontal(classes="head-row"):
            yield StopKey(" ■ STOP  Ctrl+C or F9 ", classes="stop-key")
            yield Panel(classes="head-state", markup=False)
        yield Panel(classes="alarm", markup=False)

    def show(self, view: View) -> None:
        if not (
            self.query(".alarm") and self.query(".head-state")
        ):  # a dialog just opening, or the application closing
            return
        lines = Text(overflow="ellipsis", no_wrap=True)
        name = view.snapshot.campaign if view.snapshot is not None else "rig console"
        doing = wording.activity(view.snapshot) if view.snapshot is not None else "no data yet"
        live = view.condition == "live"
        ended = view.snapshot is not None and view.snapshot.state == "done"
        if view.snapshot is not None and not live and not ended:
            doing = f"last known: {doing}"
        lines.append(doing, "bold #ffffff").append(f"   {name}\n", "#b0b0b0")
        lines.append(wording.link(view), "#7fd88f" if live else "#b0b0b0" if ended else "bold #ff9090")
        lines.append(_attendance(view) if live else "", "#b0b0b0")
        if view.snapshot is not None and view.snapshot.files:
            lines.append(
                f"\n{view.snapshot.files[-1]}", "#b0b0b0"
            )  # a third line, where the screen is tall enough for it
        state = self.query_one(".head-state", Panel)
        state.put((lines.plain, view.condition), lines)
        self._shout(view)

    def _shout(self, view: View) -> None:
        said = alarm(view)
        line = self.query_one(".alarm", Panel)
        line.put(said, Text(said.text, "bold"))
        for severity in ("none", "info", "warning", "danger"):
            line.set_class(severity == said.severity, severity)


def _attendance(view: View) -> str:
    if view.snapshot is None or view.snapshot.replay:
        return ""
    if view.looks_on:
        return "   READ-ONLY: press l to attend"
    return "   attended: stops without you" if view.snapshot.attended else "   unattended: goes on without you"


class ProgressPanel(Panel):
    """Campaign and step, two lines."""

    def show(self, view: View) -> None:
        snapshot, width = view.snapshot, self.content_size.width
        if snapshot is None or snapshot.progress is None:
            self.put("none", Text("no run yet"))
            return
        progress = snapshot.progress
        lines = Text(no_wrap=True)
        lines.append(wording.campaign_line(progress, snapshot.thruster, width) + "\n")
        lines.append(wording.step_line(progress, snapshot, width))
        self.put(lines.plain, lines)


class StandingPanel(Panel):
    """Whether the run fits so far; where and how it does not, in two lines."""

    def show(self, view: View) -> None:
        said = standing(view, self.content_size.width)
        self.set_class(said is None, "nothing")
        if said is None:
            return
        style = "#7fd88f" if said.fits else f"bold {LOG_STYLES['warning']}"
        text = Text(no_wrap=True, overflow="ellipsis")
        for n, line in enumerate(said.lines):
            text.append(("\n" if n else "") + line, style if n == 0 else "")
        self.set_class(said.fits, "fits")
        self.put((text.plain, said.fits), text)


class ReadingsPanel(Panel):
    """Live numbers."""

    def show(self, view: View) -> None:
        text = readings_text(view)
        self.put((text.plain, view.condition), text)


class ChecksPanel(Panel):
    """The preflight list and what follows from it."""

    def show(self, view: View) -> None:
        checks = view.snapshot.checks if view.snapshot is not None else ()
        state = view.snapshot.state if view.snapshot is not None else "connecting"
        refused = refusal(view.snapshot)
        said = [Text(refused, LOG_STYLES["warning"])] if refused else []
        self.put((checks, state, refused), Group(verdict_summary(checks, state), *said, Text(), checks_table(checks)))


class ResultsPanel(Panel):
    """The table per thruster, how it ended, and where the files are."""

    def show(self, view: View) -> None:
        snapshot = view.snapshot
        if snapshot is None:
            return
        made_of = (tuple(view.points.items()), snapshot.files, snapshot.outcome, snapshot.cause)
        self.put(made_of, Group(results_table(view.points), Text(), *_ending(view, snapshot)))


def _ending(view: View, snapshot: Snapshot) -> list[Text]:
    wrong = misfits(view.points)
    lines = [*wrong, *([Text()] if wrong else [])]
    lines += [Text(f"outcome: {snapshot.outcome or 'not started'}. {snapshot.cause}", "bold"), Text()]
    missing = len(snapshot.files) - len(view.points)
    if missing > 0 and snapshot.state == "done":
        lines += [
            Text(f"{missing} more recordings were made before this console attached: `rig fit` reads them all."),
            Text(),
        ]
    lines.append(Text("recordings:" if snapshot.files else "no recording was made", "bold"))
    return lines + [Text(f"  {name}", overflow="fold") for name in snapshot.files]


class LogPanel(RichLog):
    """Events, newest last; scrolls with the wheel and, when focused, the arrow keys."""

    count = 0
    """Events written so far, by the controller's count."""
    lines_known: tuple[LogLine, ...] = ()
    chosen: tuple[LogFilter, int] = ("run", BEFORE)
    """Filter, and the run that goes on."""

    def show(self, view: View, chosen: LogFilter) -> None:
        """Events that the filter lets through; all again when it was changed."""
        entitle(self, TITLES[chosen])
        if view.snapshot is None:
            return
        if self.chosen != (chosen, run_of(view.snapshot)):
            self.chosen = (chosen, run_of(view.snapshot))
            self.clear()
            self.count = 0
        self.lines_known = view.snapshot.log
        if not self.size:  # hidden: `on_resize` writes everything once there is room
            return
        new = min(view.snapshot.log_count - self.count, len(self.lines_known))
        self.count = view.snapshot.log_count
        for line in self.lines_known[len(self.lines_known) - new :] if new > 0 else ():
            if wanted(line, *self.chosen):
                self.write(event_row(line), expand=True)

    def on_resize(self, _: Resize) -> None:
        """Lines were wrapped for the old width: the next `show` writes them all again."""
        self.clear()
        self.count = 0


def event_row(line: LogLine) -> Table:
    """`   12.3 s  WARN  text`, a long text in its own column: the level is a word too."""
    row = Table.grid(padding=(0, 2))
    row.add_column(no_wrap=True)
    row.add_column(ratio=1)
    style = LOG_STYLES[line.level]
    row.add_row(Text(f"{line.time:8.1f} s  {LOG_WORDS[line.level]}", style), Text(line.text, style))
    return row
