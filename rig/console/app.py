"""The console application: folds snapshots into a view, shows it, turns keys into requests. It asks and never acts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import ClassVar, Final

from textual import events
from textual.app import ComposeResult
from textual.await_complete import AwaitComplete
from textual.binding import Binding, BindingType
from textual.containers import Container, Horizontal, Vertical, VerticalScroll
from textual.filter import LineFilter
from textual.message import Message
from textual.widgets import ContentSwitcher

from rig.console.bench_page import BenchPanel
from rig.console.chooser import Chooser
from rig.console.choosing import ChoosingApp
from rig.console.diagnosing import DIAGNOSE, DiagnosingApp, DiagnosisPanel
from rig.console.dialogs import LeaveDialog, NoteDialog
from rig.console.feed import Feed
from rig.console.few_colors import filters_for
from rig.console.history import CompareDialog, HistoryApp, HistoryPanel
from rig.console.interpreter import forget_closed
from rig.console.key_help import KeyHelp
from rig.console.keys_in_order import KeysInOrder
from rig.console.panels import (
    ChecksPanel,
    Head,
    LogPanel,
    Panel,
    ProgressPanel,
    ReadingsPanel,
    ResultsPanel,
    StandingPanel,
)
from rig.console.plots import FitPlot, ResidualPlot, TimePlot
from rig.console.sweep_dialog import SweepDialog
from rig.console.toasts import place
from rig.console.view_model.actions import bindings
from rig.console.view_model.alarms import call
from rig.console.view_model.keys import key_line, page_of
from rig.console.view_model.log_filter import NEXT, LogFilter
from rig.console.view_model.view import View, absorb
from rig.link.attention import Bell

REDRAW: Final = 0.1
"""s between looks at the text: as often as snapshots come."""
REPLOT: Final = 0.2
"""s between looks at the plots: one costs 10-20 ms, and the stop key must not wait for many."""
LEASE: Final = 0.5
"""s between leases. From the screen's own loop on purpose: when the screen hangs, the lease goes stale."""
STOP_KEYS: Final = ("ctrl+c", "super+c", "f9")
"""super+c is Cmd+C where a terminal passes it on."""


class ConsoleApp(ChoosingApp, DiagnosingApp, HistoryApp, inherit_bindings=False):
    """One operator's window on one controller."""

    CSS_PATH = "console.tcss"
    TITLE = "rig console"
    ENABLE_COMMAND_PALETTE = False
    ALLOW_SELECT = False  # nothing to copy: Ctrl+C is the stop key
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(keys, run, name, priority=first) for keys, run, name, first in bindings()
    ]

    def __init__(
        self,
        feed: Feed,
        clock: Callable[[], float],
        again: str = "rig console",
        diagnose: Sequence[str] = DIAGNOSE,
        *,
        silent: bool = False,
        colors: str = "full",
        looks_on: bool = False,
        begins: bool = False,
        earlier: Sequence[str] = (),
        folder: str = "",
    ) -> None:
        """`clock` gives s and never goes back; `again` is the command line that attaches once more, `diagnose` one to
        which a recording is added. `silent`: it never rings; `colors`: `full`, `16` or `none`.
        `looks_on`: whoever else attends, it does so from `l` on only. `begins`: what it leaves in `next_run` is run;
        `earlier`: recordings that each of this campaign is diagnosed with;
        `folder`: where it records."""
        super().__init__(feed, clock, View(now=clock(), looks_on=looks_on))
        self.HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (110, "-wide")]  # columns from which all panels fit at once
        self.VERTICAL_BREAKPOINTS = [(0, "-low"), (32, "-tall")]  # rows
        self.again = again
        self.diagnose, self.begins, self.earlier = diagnose, begins, earlier
        self.run_folder = folder
        self.set_class(colors != "full", "-few-colors")
        self.chosen = "main"
        self.log_filter: LogFilter = "run"
        self.in_order = KeysInOrder(self)
        self.calls, self.silent, self.terminal_colors = Bell(), silent, colors

    def compose(self) -> ComposeResult:
        yield Head()
        with ContentSwitcher(initial="preflight", id="pages"):
            with VerticalScroll(id="preflight"):
                yield ChecksPanel()
            with Container(id="live", classes="main"):
                yield ProgressPanel(id="progress")
                yield StandingPanel(id="standing", markup=False)
                with Horizontal():
                    with Vertical(id="words"):
                        with VerticalScroll(id="readings"):
                            yield ReadingsPanel(markup=False)
                        yield LogPanel(id="log", min_width=20, wrap=True)
                    with Vertical(id="plots"):
                        yield FitPlot()
                        yield ResidualPlot()
                        yield TimePlot()
            with VerticalScroll(id="results"):
                yield ResultsPanel()
            with VerticalScroll(id="diagnosis"):
                yield DiagnosisPanel()
            with VerticalScroll(id="bench"):
                yield BenchPanel()
            with Container(id="history"):
                yield HistoryPanel(markup=False)
        yield Panel(id="keys", markup=False)

    def on_mount(self) -> None:
        self.query_one("#readings").border_title = "live readings"
        self.query_one("#preflight").border_title = "preflight"
        self.query_one("#results").border_title = "result per thruster: C V|V| fitted to the holds"
        self.query_one("#diagnosis").border_title = "diagnosis: what C V|V| leaves out"
        self.query_one("#bench").border_title = "bench: who is there, and how well it is heard"
        self.query_one("#history").border_title = "history: what was measured before, newest first"
        self.run_worker(self._follow())
        self.set_interval(REDRAW, self.show_text)
        self.set_interval(REPLOT, self.show_plots)
        self.set_interval(LEASE, self.renew_lease)
        self.renew_lease()

    async def on_unmount(self) -> None:
        """The console goes: so does what computes beside it."""
        await self.end_diagnosis()
        await self.end_history()

    async def _follow(self) -> None:
        while (snapshot := await self.feed.receive()) is not None:
            ended_before = self.ended
            self.state = absorb(self.state, snapshot, self.clock())
            if self.ended and not ended_before:
                self.chosen = "results"
            self.part()
        self.state = replace(self.state, connected=False)
        if self.parting is not None and self.parting.kind == "detach":
            self.exit()

    def get_line_filters(self) -> Sequence[LineFilter]:
        return filters_for(self.terminal_colors, super().get_line_filters())

    def _standing(self) -> bool:
        """False while the application closes: its widgets go before its timers."""
        return bool(self.screen_stack) and len(self.screen_stack[0].query("#keys")) > 0

    def show_text(self) -> None:
        """Everything but the plots, from the view."""
        self.state = replace(self.state, now=self.clock())
        self.part()
        if not self._standing():
            return
        view, base = self.state, self.screen_stack[0]
        base.query_one(ContentSwitcher).current = page_of(view, self.chosen)
        base.query_one("#live").set_classes(self.chosen)
        base.query_one(Head).show(view)
        base.query_one(ChecksPanel).show(view)
        base.query_one(ProgressPanel).show(view)
        base.query_one(StandingPanel).show(view)
        base.query_one(ReadingsPanel).show(view)
        base.query_one(ResultsPanel).show(view)
        if self.chosen == "bench":
            base.query_one(BenchPanel).show(view)
        base.query_one(LogPanel).show(view, self.log_filter)
        base.query_one("#keys", Panel).put(line := key_line(view), line)
        if isinstance(self.screen, NoteDialog | LeaveDialog | KeyHelp | Chooser | SweepDialog | CompareDialog):
            self.screen.show(view)
        base.set_class(view.condition != "live", "old")
        place(self.screen, below=base.query_one(Head).size.height)
        self._ring(call(view))

    def _ring(self, wanted: str) -> None:
        """The terminal's bell for what somebody must come for."""
        if self.calls.rings(wanted, self.state.now) and not self.silent:
            self.bell()

    def show_plots(self) -> None:
        """The plots that are on the screen, from the view."""
        if self._standing():
            base = self.screen_stack[0]
            base.query_one(FitPlot).show(self.state)
            base.query_one(ResidualPlot).show(self.state)
            base.query_one(TimePlot).show(self.state)

    def post_message(self, message: Message) -> bool:
        """Takes the stop key as it arrives: it waits behind no other key, and no dialog or text field sees it."""
        if isinstance(message, events.Key) and message.key in STOP_KEYS:
            self.action_stop()
            return True
        return super().post_message(message)

    async def on_event(self, event: events.Event) -> None:
        """Keys come here first, and those that a widget has not used a second time."""
        await self.in_order.handle(event, super().on_event)

    def pop_screen(self) -> AwaitComplete:
        """Of any dialog that closes."""
        forget_closed()
        return super().pop_screen()

    def action_view(self, name: str) -> None:
        self.chosen = name
        self.show_text()
        if name in ("bench", "diagnosis") and len(self.screen_stack) == 1:
            self.query_one(f"#{name}").focus()  # the arrow keys scroll it
        if name == "history" and len(self.screen_stack) == 1:
            self.open_history()
        self.call_after_refresh(self.show_plots)

    def look_at_time(self) -> None:
        if self.query_one(TimePlot).size:
            self.show_plots()
        else:
            self.action_view("time")

    def action_filter(self) -> None:
        """F: which events are shown."""
        self.log_filter = NEXT[self.log_filter]
        self.show_text()

    def action_help(self) -> None:
        self.push_screen(KeyHelp())
        self.call_after_refresh(self.show_text)

    async def action_note(self) -> None:
        if self.only_looks_on():
            return  # before the line is typed, not after
        await self.push_screen(NoteDialog(), self._keep_note)
        self.call_after_refresh(self.show_text)

    def _keep_note(self, text: str | None) -> None:
        if text:
            self.action_ask("note", text)
