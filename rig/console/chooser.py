"""A dialog to choose one of many by typing a part of its name: the command palette, and the channel on the time plot.

Textual's own palette is not used: its screen has neither the stop key's label nor the alarm line, its hits come some
time after the letters (an Enter in the same burst takes another one, or none), and it can't show what is not possible.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, OptionList, Static

from rig.console.panels import Head
from rig.console.view_model.palette import Entry, matching
from rig.console.view_model.view import View

Entries = Callable[[View], tuple[Entry, ...]]
WIDEST, BESIDE = 24, 11
"""Cells of the columns."""
HINT = "Enter, Escape, arrows. Ctrl+C or F9 stops the motor, here too."


class Chooser(ModalScreen[str]):
    """Dismissed with the value chosen, or with an empty string. What is not possible now is listed too, with why."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "cancel", "cancel", priority=True),
        Binding("enter", "choose", "choose", priority=True),
        Binding("down", "move('cursor_down')", "down", priority=True),
        Binding("up", "move('cursor_up')", "up", priority=True),
        Binding("pagedown", "move('page_down')", "page down", priority=True),
        Binding("pageup", "move('page_up')", "page up", priority=True),
    ]

    def __init__(self, title: str, entries: Entries, view: View, chosen: str = "") -> None:
        """`chosen`: the value that is marked at first."""
        super().__init__()
        self.question, self.entries, self.view, self.chosen = title, entries, view, chosen
        self.listed: tuple[Entry, ...] = ()

    def compose(self) -> ComposeResult:
        yield Head()
        with Vertical(classes="dialog chooser"):
            yield Static(self.question, classes="dialog-title")
            yield Input(placeholder="type a part of its name", max_length=60)
            yield OptionList(markup=False)
            yield Static(HINT, classes="dialog-hint", markup=False)

    def on_mount(self) -> None:
        field, options = self.query_one(Input), self.query_one(OptionList)
        field.cursor_blink = options.can_focus = False
        self.set_focus(field)  # at once: the next key may be there already
        self._list()
        options.highlighted = next((n for n, entry in enumerate(self.listed) if entry.value == self.chosen), 0)

    def show(self, view: View) -> None:
        for head in self.query(Head):
            head.show(view)
        self.view = view
        if self.is_mounted and self.query(OptionList):
            self._list()

    def on_input_changed(self, _: Input.Changed) -> None:
        self._list()

    def on_option_list_option_selected(self, _: OptionList.OptionSelected) -> None:
        """A click."""
        self.action_choose()

    def _list(self) -> None:
        """What fits what is typed; the mark goes to the first where the list has become another one."""
        options = self.query_one(OptionList)
        found = matching(self.entries(self.view), self.query_one(Input).value)
        if found == self.listed:
            return
        same = [entry.value for entry in found] == [entry.value for entry in self.listed]
        at, self.listed = options.highlighted, found
        width = min(WIDEST, max((len(entry.name) for entry in self.entries(self.view)), default=0))
        options.set_options([row_of(entry, width) for entry in found])
        options.highlighted = (at if same else 0) if found else None

    def action_move(self, how: str) -> None:
        self._list()
        options = self.query_one(OptionList)
        if self.listed:
            getattr(options, f"action_{how}")()

    def action_choose(self) -> None:
        self._list()  # the last letters may have been typed in the same burst
        at = self.query_one(OptionList).highlighted
        if at is None:
            self._say("nothing has that name")
        elif self.listed[at].not_now:
            self._say(f"{self.listed[at].name}: not now, {self.listed[at].not_now}")
        else:
            self.dismiss(self.listed[at].value)

    def _say(self, text: str) -> None:
        self.query_one(".dialog-hint", Static).update(Text(text, "bold"))

    def action_cancel(self) -> None:
        self.dismiss("")


def row_of(entry: Entry, width: int) -> Text:
    """One line: a name of `width` cells, key or unit, and what it does or why it can't be done."""
    says, style = (f"not now: {entry.not_now}", "#9a9a9a") if entry.not_now else (entry.says, "")
    row = Text(no_wrap=True, overflow="ellipsis")
    row.append(f"{entry.name:<{width}} ", style if entry.not_now else "bold")
    return row.append(f"{entry.beside:<{BESIDE}} ", style).append(says, style)
