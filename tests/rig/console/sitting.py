"""An operator at a console whose controller is a played feed."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass

from textual.pilot import Pilot
from textual.widget import Widget

from rig.console.app import ConsoleApp
from rig.console.panels import Panel
from rig.link.front_end_messages import RequestKind, Snapshot
from tests.rig.console.feeds import ManualClock, PlayedFeed
from tests.rig.console.scenes import settle, show


@dataclass(frozen=True)
class Desk:
    app: ConsoleApp
    pilot: Pilot[None]
    feed: PlayedFeed
    clock: ManualClock

    async def press(self, *keys: str) -> None:
        await self.pilot.press(*keys)

    async def play(self, snapshot: Snapshot) -> None:
        """One more snapshot, absorbed and drawn."""
        self.feed.play(snapshot)
        await settle(self.pilot, lambda: self.app.state.snapshot is snapshot)
        await self.draw()

    async def lose(self) -> None:
        """The controller is gone, and the console has noticed."""
        self.feed.end()
        await settle(self.pilot, lambda: not self.app.state.connected)
        await self.draw()

    async def draw(self) -> None:
        await show(self.pilot, self.app)

    async def glance(self) -> None:
        """Draw once: enough where what is drawn is not looked at."""
        self.app.show_text()
        self.app.show_plots()
        await self.pilot.pause()

    async def wait(self, seconds: float) -> None:
        """Let that much of the console's time pass with nothing coming."""
        self.clock.now += seconds
        await self.draw()

    def kinds(self) -> list[RequestKind]:
        return self.feed.kinds()

    def alarm(self) -> str:
        """The alarm line of the screen on top, whatever that is."""
        line = self.app.screen.query_one(".alarm", Panel)
        return str(line.render()) if line.display else ""

    def text(self, what: str | type[Widget]) -> str:
        """What a text panel shows, as plain text."""
        selected = self.app.screen_stack[0].query_one(what)
        return "\n".join("".join(segment.text for segment in strip) for strip in
                         (selected.render_line(y) for y in range(selected.size.height)))  # fmt: skip

    def toasts(self) -> list[str]:
        return [notification.message for notification in self.app._notifications]


@asynccontextmanager
async def sitting(*snapshots: Snapshot, size: tuple[int, int] = (80, 24)) -> AsyncIterator[Desk]:
    """A console that has shown the last of `snapshots`."""
    feed, clock = PlayedFeed(*snapshots, stopwatch=time.perf_counter), ManualClock()
    app = ConsoleApp(feed, clock, "rig console recordings/run")
    async with app.run_test(size=size) as pilot:
        desk = Desk(app, pilot, feed, clock)
        if snapshots:
            await settle(pilot, lambda: app.state.snapshot is snapshots[-1])
        await desk.draw()
        yield desk
