"""The two dialogs: a note, and leaving. The stop key is on both, and works in both."""

from __future__ import annotations

from typing import ClassVar, Literal

from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen
from textual.widgets import Button, Input, Static

from rig.console.panels import Head
from rig.console.view_model.view import View
from rig.link.front_end_messages import Snapshot

Leaving = Literal["detach", "stop"]


class NoteDialog(ModalScreen[str]):
    """Asks for one line; dismissed with it, or with an empty string."""

    BINDINGS: ClassVar[list[BindingType]] = [("escape", "cancel", "cancel"), ("enter", "keep", "keep")]

    def compose(self) -> ComposeResult:
        yield Head()
        with Vertical(classes="dialog"):
            yield Static("Note for the recording", classes="dialog-title")
            yield Input(placeholder="what you see, hear or changed", max_length=500)
            yield Static(
                "Enter keeps it, Escape drops it. Ctrl+C or F9 stops the motor, here too.", classes="dialog-hint"
            )

    def on_mount(self) -> None:
        self.query_one(Input).cursor_blink = False  # nothing on this screen moves but what is measured

    def show(self, view: View) -> None:
        for head in self.query(Head):
            head.show(view)

    def on_input_submitted(self, _: Input.Submitted) -> None:
        self.action_keep()

    def action_keep(self) -> None:
        """Also where the text field has lost its focus: every Enter closes the dialog."""
        self.dismiss(self.query_one(Input).value.strip())

    def action_cancel(self) -> None:
        self.dismiss("")


class LeaveDialog(ModalScreen[Leaving | None]):
    """Says what leaving will do to the campaign before it is done; dismissed with None to stay."""

    BINDINGS: ClassVar[list[BindingType]] = [("escape", "stay", "stay")]

    def __init__(self, snapshot: Snapshot | None, again: str) -> None:
        """`again` is the command that attaches once more."""
        super().__init__()
        self.leaving: Leaving = what_leaving_is(snapshot)
        self.again = again

    def compose(self) -> ComposeResult:
        yield Head()
        with Vertical(classes="dialog"):
            yield Static("Leave the console?", classes="dialog-title")
            yield Static(consequence(self.leaving, self.again), markup=False)
            with Horizontal(classes="dialog-buttons"):
                yield Button("Stay (Escape)", id="stay")
                if self.leaving == "detach":
                    yield Button("Leave, campaign goes on", id="leave", variant="warning")
                else:
                    yield Button("STOP the motor and leave", id="leave", variant="error")

    def show(self, view: View) -> None:
        for head in self.query(Head):
            head.show(view)

    def on_button_pressed(self, event: Button.Pressed) -> None:
        self.dismiss(self.leaving if event.button.id == "leave" else None)

    def action_stay(self) -> None:
        self.dismiss(None)


def what_leaving_is(snapshot: Snapshot | None) -> Leaving:
    """An attended campaign may not be left alone by its only console: leaving it is stopping it."""
    alone = snapshot is None or (snapshot.attended and snapshot.clients <= 1)
    return "stop" if alone else "detach"


def consequence(leaving: Leaving, again: str) -> str:
    """What will happen, in sentences."""
    if leaving == "detach":
        return f"The campaign goes on without this console: the motor keeps turning.\nAttach again with:  {again}"
    return (
        "This campaign is attended, and yours is its only console: the controller refuses to be left alone.\n"
        "Leaving stops it: command to 0 V, recording closed. The console waits until the propeller is measured at rest."
    )
