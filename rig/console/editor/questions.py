"""Dialogs of the editor: a question with its answers, the harmless one first, and the keys."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Final

from rich.table import Table
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Button, Static

KEYS: Final = (
    ("Tab, Down", "the next field"),
    ("Shift+Tab, Up", "the field before"),
    ("Left, Right, Space", "another word, in a field with ‹ ›"),
    ("Ctrl+U", "empty the field: its key leaves the file, its default holds"),
    ("Ctrl+S", "save the file"),
    ("Ctrl+Z", "undo the last change"),
    ("Page Up, Page Down", "scroll the form; after the last field: the dry run"),
    ("Escape, Ctrl+Q", "leave; asks when something is not saved"),
    ("F1; ? in a field with ‹ ›", "these keys"),
)
ABOUT: Final = (
    "The editor opens no device and starts no run. Numbers: 12.5; lists: 4, 0, -4. Comments, order and form of the "
    "file stay as they are."
)


class Question(ModalScreen[str]):
    """Dismissed with the answer's name; Escape is the first answer."""

    BINDINGS: ClassVar[list[BindingType]] = [
        ("escape", "first", "first"),
        ("right,down", "app.focus_next", "next"),
        ("left,up", "app.focus_previous", "previous"),
    ]

    def __init__(self, title: str, text: str, answers: Sequence[tuple[str, str]]) -> None:
        """`answers`: (name, words on its button)."""
        super().__init__()
        self.question, self.text, self.answers = title, text, tuple(answers)

    def compose(self) -> ComposeResult:
        with Vertical(classes="dialog"):
            yield Static(self.question, classes="dialog-title", markup=False)
            yield Static(self.text, markup=False)
            with Horizontal(classes="dialog-buttons"):
                for name, words in self.answers:
                    yield Button(words, id=name, compact=True)

    def on_button_pressed(self, event: Button.Pressed) -> None:
        self.dismiss(event.button.id)

    def action_first(self) -> None:
        self.dismiss(self.answers[0][0])


class Keys(ModalScreen[None]):
    """Every key; any of Escape, F1, ? and q closes it."""

    BINDINGS: ClassVar[list[BindingType]] = [("escape,f1,question_mark,q", "close", "close")]

    def compose(self) -> ComposeResult:
        table = Table.grid(padding=(0, 2))
        for key, does in KEYS:
            table.add_row(f"[bold]{key}[/]", does)
        with VerticalScroll(classes="dialog keys"):
            yield Static("Keys", classes="dialog-title")
            yield Static(table)
            yield Static(ABOUT, classes="dialog-hint", markup=False)

    def action_close(self) -> None:
        self.dismiss(None)
