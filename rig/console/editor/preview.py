"""The dry run at the right: what is wrong, what it will take, and the command over its time."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text
from textual.widgets import Static
from textual_plotext.plot import Plot

from rig.campaign.plan import Step
from rig.console.plots import AMBER, Curve
from rig.console.view_model.axes import reach, thin, ticks, to_row
from rig.dry_run.command import corners
from rig.dry_run.outlook import Assessment
from rig.visible_text import visible

MINUTES = 180.0
"""s from which the axis of time is in minutes."""


class Problem(Static):
    """The first sentence that keeps the campaign from running; not there when it may run."""

    def show(self, found: Assessment) -> None:
        self.display = bool(found.problem)
        self.update(Text(f"PROBLEM  {visible(found.problem)}"))


class Numbers(Static):
    """What it will take, and what an operator must know."""

    def show(self, found: Assessment) -> None:
        table = Table.grid(padding=(0, 1))
        table.add_column(no_wrap=True, style="bold")
        table.add_column(overflow="fold")
        for what, told in found.rows:
            table.add_row(what, Text(visible(told)))
        for note in found.notes:
            table.add_row("note", Text(visible(note)))
        if not found.rows:
            table.add_row("", Text("No numbers until it may run." if found.steps else "No plan to draw yet."))
        self.update(table)


class CommandPlot(Curve):
    """Command in V over the expected time of one run."""

    def show(self, steps: tuple[Step, ...]) -> None:
        self.display = bool(steps)
        self.border_title = "command (V) over time" + (" (min)" if _long(steps) else " (s)")
        self.redraw((steps, self.size), lambda plot: self._draw(plot, steps))

    def _draw(self, plot: Plot, steps: tuple[Step, ...]) -> None:
        if not steps:
            return
        time, volts = corners(steps)
        unit = 60.0 if _long(steps) else 1.0
        at, command = thin(list(zip((time / unit).tolist(), volts.tolist(), strict=True)), 2 * self.size.width)
        low, high = reach(command, least=1.0)
        end = max(float(time[-1]) / unit, 1e-3)
        plot.xlim(0.0, end)
        plot.ylim(low, high)
        plot.xticks(*ticks(0.0, end, max(3, self.size.width // 10)))
        rows = self.size.height - 3  # frame and x ticks take three
        places, labels = ticks(low, high, max(4, rows // 2))
        plot.yticks([to_row(place, low, high, rows) for place in places], labels)
        plot.plot(at, command, marker="braille", color=AMBER)


def _long(steps: tuple[Step, ...]) -> bool:
    return sum(step.expected for step in steps) > MINUTES
