"""The form: a row for each key of a campaign file, shown while it means something. Rows are made once and stay."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import ClassVar, Final

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, VerticalScroll
from textual.message import Message
from textual.reactive import reactive
from textual.widgets import Input, Static

from rig.editing.document import Document
from rig.editing.fields import Field, every_field, meant
from rig.visible_text import visible

NAMES: Final[Mapping[tuple[str, ...], str]] = {("plan", "kind"): "order (kind)"}
"""In the form; else the last word of the key."""


class Choice(Static, can_focus=True):
    """One of a few words: Left and Right, or Space, go from one to the next."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("right,space", "turn(1)", "next"),
        Binding("left", "turn(-1)", "the one before"),
    ]
    value: reactive[str] = reactive("", init=False)

    class Changed(Message):
        """Another one was chosen by a key."""

        def __init__(self, choice: Choice) -> None:
            super().__init__()
            self.choice = choice

    def __init__(self, field: Field) -> None:
        super().__init__(markup=False)
        self.choices, self.default = field.choices, field.default

    def render(self) -> str:
        return f"‹ {visible(self.value) or self.default or 'choose'} ›"

    def action_turn(self, by: int) -> None:
        now = self.value or self.default
        at = self.choices.index(now) if now in self.choices else -1 if by > 0 else 0
        self.value = self.choices[(at + by) % len(self.choices)]
        self.post_message(self.Changed(self))


class Row(Horizontal):
    """One key: its name, its value, its unit or default."""

    def __init__(self, field: Field) -> None:
        super().__init__(classes="row")
        self.field = field
        self.shown = ""
        """What the value was when it was last taken from the document."""
        self.control: Input | Choice = Choice(field) if field.choices else Input(compact=True, max_length=2000)

    def compose(self) -> ComposeResult:
        yield Static(NAMES.get(self.field.key, self.field.name), classes="name", markup=False)
        yield self.control
        yield Static(self.field.unit, classes="unit", markup=False)

    @property
    def typed(self) -> str:
        return self.control.value

    def on_mount(self) -> None:
        if isinstance(self.control, Input):
            self.control.cursor_blink = False
            self.control.placeholder = self.field.default and f"{self.field.default} (default)"

    def load(self, document: Document) -> None:
        """Take the value from the document."""
        fits = self.field.one_line(document)
        self.control.disabled = not fits
        self.shown = document.written(self.field.key) if fits else "(more than a line: see the file)"
        if self.control.value != self.shown:
            with self.prevent(Input.Changed):
                self.control.value = self.shown
            if isinstance(self.control, Input):
                self.control.cursor_position = len(self.shown)

    def mark(self, wrong: bool) -> None:
        """A sign beside the name, for it is told without colour too."""
        name = NAMES.get(self.field.key, self.field.name)
        self.query_one(".name", Static).update(f"! {name}" if wrong else name)
        self.set_class(wrong, "wrong")


class Form(VerticalScroll, can_focus=False, inherit_bindings=False):
    """All rows, with a heading over each table of the file."""

    def compose(self) -> ComposeResult:
        table: tuple[str, ...] = ()
        for field in every_field():
            if field.key[:-1] != table:
                table = field.key[:-1]
                yield Static(f"[{'.'.join(table)}]", classes="table", markup=False)
            yield Row(field)

    def rows(self) -> Iterator[Row]:
        yield from self.query(Row)

    def focus_first(self) -> None:
        """The first field of the plan: what is changed most."""
        row = next(row for row in self.rows() if row.field.key == ("plan", "kind"))
        row.control.focus()

    def row_of(self, control: object) -> Row | None:
        """The row that a widget is the field of."""
        return next((row for row in self.rows() if row.control is control), None)

    def pending(self) -> list[Row]:
        """Rows in which something was typed since they were last taken from the document."""
        return [row for row in self.rows() if row.typed != row.shown]

    def load(self, document: Document, besides: Collection[object] = (), *, anew: bool = False) -> None:
        """Take every value from the document but those of the widgets `besides`, and where something was typed that
        the document does not have: keys that have been pressed may still be on their way. `anew`: all of them."""
        for row in self.rows():
            row.display = row.control in besides or meant(row.field, document)
            if anew or (row.control not in besides and row.typed == row.shown):
                row.load(document)
