"""Dialogs of a calibration: other weights, back to a step, keys."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Final

from rich.table import Table
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, Static

KEYS: Final = (
    ("Enter", "the load hangs free and still: wait until it has settled, and read it"),
    ("e", "other weights hang than the plan has: say which"),
    ("r", "hang and read the step before again; of a doubted step: that one"),
    ("b", "go back to any step that was read, and read it again"),
    ("s", "leave this step out"),
    ("o", "of a doubted step: what the reading says is what hung"),
    ("k", "of a doubted step: keep it as it is"),
    ("q, Escape", "end without a calibration; asks first. What was read stays in the recording"),
)


class Typed(ModalScreen[str]):
    """A line is asked for until `fault` finds none in it; Escape takes nothing (dismissed with "")."""

    BINDINGS: ClassVar[list[BindingType]] = [("escape", "nothing", "nothing")]

    def __init__(self, title: str, hint: str, fault: Callable[[str], str]) -> None:
        super().__init__()
        self.title_text, self.hint, self.fault = title, hint, fault

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog"):
            yield Static(self.title_text, classes="dialog-title", markup=False)
            yield Input(compact=True)
            yield Static(self.hint, classes="dialog-hint", markup=False)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        wrong = self.fault(event.value)
        if wrong:
            self.query_one(".dialog-hint", Static).update(wrong)
        else:
            self.dismiss(event.value)

    def action_nothing(self) -> None:
        self.dismiss("")


class Keys(ModalScreen[None]):
    """Every key; any of Escape, ? and q closes it."""

    BINDINGS: ClassVar[list[BindingType]] = [("escape,question_mark,q,enter", "close", "close")]

    def compose(self) -> ComposeResult:
        rows = Table.grid(padding=(0, 2))
        for key, does in KEYS:
            rows.add_row(f"[bold]{key}[/]", does)
        with Vertical(classes="dialog"):
            yield Static("Keys", classes="dialog-title")
            yield Static(rows)

    def action_close(self) -> None:
        self.dismiss(None)
