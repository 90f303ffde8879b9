"""The dialogs in which the operator chooses by name. Each is awaited, so that what is typed next is typed into it."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace

from rig.console.chooser import Chooser
from rig.console.leaving import LeavingApp
from rig.console.view_model.palette import commands
from rig.console.view_model.traces import channels_to_choose, plotted


class ChoosingApp(LeavingApp, inherit_bindings=False):
    """The part of the console that lists what there is to do."""

    @abstractmethod
    def look_at_time(self) -> None:
        """Show the time plot, if it is not on the page."""

    async def action_palette(self) -> None:
        """Every action by its name."""
        await self.push_screen(Chooser("Commands", commands, self.state), self._run_chosen)
        self.show_text()

    async def action_channel(self) -> None:
        """C: which recorded channel the time plot shows."""
        shown = plotted(self.state)
        if shown is None:
            self.notify("The channels are known when the first data have come.", severity="warning")
            return
        title = "Channel on the time plot"
        await self.push_screen(Chooser(title, channels_to_choose, self.state, shown.channel), self._plot)
        self.show_text()

    def _plot(self, channel: str | None) -> None:
        if channel:
            self.state = replace(self.state, plotted=channel)
            self.look_at_time()

    async def _run_chosen(self, action: str | None) -> None:
        if action:
            await self.run_action(action)
