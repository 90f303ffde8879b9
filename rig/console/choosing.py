"""The dialogs in which the operator chooses by name. Each is awaited, so that what is typed next is typed into it."""

from __future__ import annotations

from rig.console.chooser import Chooser
from rig.console.leaving import LeavingApp
from rig.console.view_model.palette import commands


class ChoosingApp(LeavingApp, inherit_bindings=False):
    """The part of the console that lists what there is to do."""

    async def action_palette(self) -> None:
        """Every action by its name."""
        await self.push_screen(Chooser("Commands", commands, self.state), self._run_chosen)
        self.show_text()

    async def _run_chosen(self, action: str | None) -> None:
        if action:
            await self.run_action(action)
