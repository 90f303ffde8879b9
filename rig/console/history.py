"""Page 8: what was measured before, from the catalogue of the output folder; two recordings or fits compared.

All of it is read and reckoned in processes of their own: the screen waits for none of them.
"""

from __future__ import annotations

import json
import sys
from abc import abstractmethod
from collections.abc import Mapping
from contextlib import aclosing
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, Final

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Static

from rig.console.children import Child
from rig.console.leaving import LeavingApp
from rig.console.panels import Head, Panel
from rig.console.view_model.history import (
    Row,
    Rows,
    compared_text,
    history_text,
    moved,
    of_run,
    row_of,
    to_compare,
    toggled,
    widths,
)
from rig.console.view_model.view import View
from rig.visible_text import visible

CATALOGUE: Final = (sys.executable, "-m", "rig.catalogue.beside_console")
HINT: Final = "Space marks, Enter compares, u reads again"
STILL_WRITTEN: Final = "A recording of this campaign is compared once the campaign has ended."
LINES: Final = 2
"""Of the panel that are no rows: heading and hint."""


class HistoryPanel(Panel, can_focus=True):
    """The rows that fit; cursor keys go through the others."""

    BINDINGS: ClassVar[list[BindingType]] = [
        ("up", "move(-1)", "up"),
        ("down", "move(1)", "down"),
        ("pageup", "turn(-1)", "page up"),
        ("pagedown", "turn(1)", "page down"),
        ("home", "move(-1000000000)", "newest"),
        ("end", "move(1000000000)", "oldest"),
        ("space", "mark", "mark"),
        ("enter,c", "compare", "compare"),
        ("u", "app.read_history", "read again"),
    ]
    rows = Rows()
    wide: tuple[int, ...] = widths(())
    running: tuple[str, ...] = ()
    says = ""

    @property
    def room(self) -> int:
        return max(self.size.height - LINES, 1)

    def show(self) -> None:
        text = history_text(self.rows, self.wide, self.size.width, self.room, self.running)
        text.append(f"\n{self.says or HINT}", "#b0b0b0")
        self.put((text.plain, self.rows.cursor), text)

    def on_resize(self) -> None:
        self.rows = moved(self.rows, 0, self.room)
        self.show()

    def action_move(self, by: int) -> None:
        self.rows = moved(self.rows, by, self.room)
        self.show()

    def action_turn(self, pages: int) -> None:
        self.action_move(pages * self.room)

    def action_mark(self) -> None:
        self.rows = toggled(self.rows)
        self.show()

    async def action_compare(self) -> None:
        if self.rows.all:
            await self.run_action("app.compare_rows")


class CompareDialog(ModalScreen[None]):
    """What came of it; scrolls where the terminal is low."""

    BINDINGS: ClassVar[list[BindingType]] = [("escape,enter,q", "close", "close")]

    def __init__(self, older: Row, newer: Row) -> None:
        super().__init__()
        self.names = f"{older.date} {older.path}\n{newer.date} {newer.path}"

    def compose(self) -> ComposeResult:
        yield Head()
        with VerticalScroll(classes="dialog keys"):
            yield Static("Has this thruster changed?", classes="dialog-title")
            yield Static(Text(f"{self.names}\n\ncompared ... (Escape leaves it)"), id="compared")

    def put(self, text: Text) -> None:
        for panel in self.query("#compared").results(Static):
            panel.update(text)

    def show(self, view: View) -> None:
        for head in self.query(Head):
            head.show(view)

    def action_close(self) -> None:
        self.dismiss(None)


class HistoryApp(LeavingApp, inherit_bindings=False):
    """The part of the console that looks back. It reads the catalogue when its page is opened, and when told to."""

    catalogue: tuple[str, ...] = CATALOGUE
    """The command that is asked."""
    run_folder: str = ""
    """Where this campaign records; empty: it is told by its recordings."""
    _reading: Child | None = None
    _comparing: Child | None = None
    _read_at: str = ""

    @abstractmethod
    def action_view(self, name: str) -> None:
        """Show that page."""

    @property
    def output(self) -> str:
        """The folder whose catalogue is shown; empty: not known yet."""
        files = self.state.snapshot.files if self.state.snapshot is not None else ()
        folder = self.run_folder or (str(Path(files[0]).parent) if files else "")
        return str(Path(folder).resolve().parent) if folder else ""

    @property
    def looks_back(self) -> bool:
        """Something is being read or compared."""
        return self._reading is not None or self._comparing is not None

    def open_history(self) -> None:
        """The page has come up: read what there is, unless it was read in this state of the run."""
        state = "ended" if self.ended else "running"
        if self._read_at != state:
            self.action_read_history()
        self.query_one(HistoryPanel).focus()

    def action_read_history(self) -> None:
        """U: read it again. While something may turn, from the index alone: no file is touched."""
        if self._reading is not None:
            return
        self._read_at = "ended" if self.ended else "running"
        self._reading = Child(self.catalogue)
        self.run_worker(self._read(self._reading), group="history", exclusive=True)

    async def action_compare_rows(self) -> None:
        """The two chosen rows, in a dialog."""
        panel = self.query_one(HistoryPanel)
        chosen = to_compare(panel.rows)
        if not isinstance(chosen, str) and not self.ended and any(of_run(row, panel.running) for row in chosen):
            chosen = STILL_WRITTEN
        if isinstance(chosen, str):
            self.notify(chosen, severity="warning", markup=False)
            return
        dialog = CompareDialog(*chosen)
        await self.push_screen(dialog, self._compared)
        self.show_text()
        self._comparing = Child(self.catalogue)
        self.run_worker(self._compare(self._comparing, dialog, chosen), group="compare", exclusive=True)

    def _compared(self, _: None) -> None:
        self.workers.cancel_group(self, "compare")

    async def end_history(self) -> None:
        """Whatever goes on for this page ends."""
        for child in (self._reading, self._comparing):
            if child is not None:
                await child.end()

    async def _read(self, child: Child) -> None:
        panel = self.query_one(HistoryPanel)
        files = self.state.snapshot.files if self.state.snapshot is not None else ()
        panel.running = tuple("/".join(Path(file).parts[-2:]) for file in files)
        try:
            if self.output:
                await self._fill(panel, child)
            else:
                panel.says = "No folder of recordings is known before the first recording."
            panel.show()
        finally:
            self._reading = None

    async def _fill(self, panel: HistoryPanel, child: Child) -> None:
        """Rows as they come; what was there before stays until there are as many."""
        new: list[Row] = []
        message: Mapping[str, Any] = {}
        wide = widths(())
        asked = json.dumps({"folder": self.output, "refresh": self.ended})
        async with aclosing(child.said(asked)) as said:
            async for message in said:
                found = _rows_in(message)
                new += found
                wide = widths(found, wide)
                panel.says = _says(message, len(new), Path(self.output).name)
                in_sight = not found or len(panel.rows.all) < panel.rows.top + panel.room
                if found and len(new) > len(panel.rows.all):
                    panel.rows, panel.wide = replace(panel.rows, all=tuple(new)), wide
                if in_sight:  # a drawing costs more than reading a hundred rows
                    panel.show()
            if "end" in message:
                panel.rows, panel.wide = moved(Rows(tuple(new)), 0, panel.room), wide

    async def _compare(self, child: Child, dialog: CompareDialog, chosen: tuple[Row, Row]) -> None:
        asked = json.dumps({"folder": self.output, "compare": [dict(row.told) for row in chosen]})
        try:
            async with aclosing(child.said(asked)) as said:
                message = await anext(said, {"fault": "it said nothing"})
            dialog.put(_answer(message))
        finally:
            self._comparing = None


def _rows_in(message: Mapping[str, Any]) -> list[Row]:
    """What is no row is left out."""
    found = []
    for told in message.get("rows", ()):
        try:
            found.append(row_of(told))
        except (KeyError, TypeError):
            continue
    return found


def _says(message: Mapping[str, Any], count: int, folder: str) -> str:
    """The line below the rows."""
    if "fault" in message:
        return visible(f"not read: {message['fault']}")
    if "end" in message:
        return visible(f"{message['end']} in {folder}.  {HINT}")
    return visible(f"reads {folder}: {message.get('at', f'{count} so far')} ...")


def _answer(message: Mapping[str, Any]) -> Text:
    try:
        return compared_text(message["compared"])
    except (KeyError, TypeError, ValueError):
        return Text(visible(f"no answer: {message.get('fault', 'it is not as thruster-rig-fit-history has it')}"))
