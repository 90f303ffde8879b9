"""Asks before the next sweep is made a campaign: which thruster's, what it does to it, and what comes then."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Vertical, VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Button, Static

from rig.console.panels import Head
from rig.console.view_model.answers import Answer, sweep_text
from rig.console.view_model.view import View

BEGINS = (
    "It is written as a campaign beside the recordings, this console closes, and that campaign opens with its "
    "preflight. The motor turns when you press F5 there, not before."
)
WRITES = (
    "It is written as a campaign beside the recordings. This console did not start the run, so it starts none: "
    "it says then what to type."
)


class SweepDialog(ModalScreen[int | None]):
    """Dismissed with the place of the answer whose sweep is wanted, or with None."""

    BINDINGS: ClassVar[list[BindingType]] = [
        ("escape", "stay", "stay"),
        ("down,right", "app.focus_next", "next"),
        ("up,left", "app.focus_previous", "previous"),
    ]

    def __init__(self, answers: Sequence[Answer], *, begins: bool) -> None:
        """`answers` have a sweep each; `begins`: whoever opened this console runs it then."""
        super().__init__()
        self.answers = answers
        self.begins = begins

    def compose(self) -> ComposeResult:
        does = "Run" if self.begins else "Write"
        yield Head()
        with Vertical(classes="dialog"):
            yield Static(f"{does} the next sweep?", classes="dialog-title")
            with VerticalScroll(classes="sweeps"):
                for answer in self.answers:
                    assert answer.sweep is not None
                    text = f"{answer.thruster}: {sweep_text(answer.sweep)}"
                    yield Static(text, markup=False, classes="sweep")
            yield Static(BEGINS if self.begins else WRITES, classes="dialog-hint")
            with Vertical(classes="sweep-buttons"):
                yield Button("Stay (Escape)", id="stay", compact=True)
                for k, answer in enumerate(self.answers):
                    yield Button(f"{does} the sweep of {answer.thruster}", id=f"sweep-{k}", compact=True)

    def on_mount(self) -> None:
        self.query_one("#stay").focus()

    def show(self, view: View) -> None:
        for head in self.query(Head):
            head.show(view)

    def on_button_pressed(self, event: Button.Pressed) -> None:
        name = event.button.id or ""
        self.dismiss(int(name.removeprefix("sweep-")) if name.startswith("sweep-") else None)

    def action_stay(self) -> None:
        self.dismiss(None)
