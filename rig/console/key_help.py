"""Every key with what it does, over whatever is on the screen. The stop key works there too."""

from __future__ import annotations

from typing import ClassVar

from rich.table import Table
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Static

from rig.console.panels import Head
from rig.console.view_model.keys import EVERY_KEY
from rig.console.view_model.view import View


class KeyHelp(ModalScreen[None]):
    """Scrolls where the terminal is low; any of Escape, ? and q closes it."""

    BINDINGS: ClassVar[list[BindingType]] = [("escape,question_mark,q", "close", "close")]

    def compose(self) -> ComposeResult:
        table = Table.grid(padding=(0, 2))
        for key, does in EVERY_KEY:
            table.add_row(f"[bold]{key}[/]", does)
        yield Head()
        with VerticalScroll(classes="dialog keys"):
            yield Static("Keys", classes="dialog-title")
            yield Static(table)

    def show(self, view: View) -> None:
        for head in self.query(Head):
            head.show(view)

    def action_close(self) -> None:
        self.dismiss(None)
