"""Leaving the console on purpose: the dialog, and waiting until the controller has settled it."""

from __future__ import annotations

from rig.console.asking import AskingApp
from rig.console.dialogs import LeaveDialog, Leaving
from rig.console.parting import begin, refused, settled


class LeavingApp(AskingApp, inherit_bindings=False):
    """The part of the console that ends it."""

    again: str
    """The command line that attaches once more."""

    def action_leave(self) -> None:
        if len(self.screen_stack) > 1:
            return  # a dialog is open: Escape first
        if self.ended or not self.state.connected or self.state.looks_on:
            self.exit()
            return
        self.push_screen(LeaveDialog(self.state.snapshot, self.again), self._leave)
        self.call_after_refresh(self.show_text)

    def _leave(self, leaving: Leaving | None) -> None:
        if leaving is None:
            return
        self.parting = begin(leaving, self.state, self.clock())
        if leaving == "stop":
            self.action_stop()
        else:
            self.action_ask("detach")

    def part(self) -> None:
        """After the operator chose to leave: go once that is settled, stay when the controller refuses."""
        if self.parting is None:
            return
        answer = refused(self.parting, self.state)
        if answer:
            self.parting = None
            self.notify(answer, title="You cannot leave", severity="error", timeout=10.0, markup=False)
        elif settled(self.parting, self.state):
            self.exit()
