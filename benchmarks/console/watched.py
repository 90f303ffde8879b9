"""The console as `rig console` runs it, with a stopwatch in it.

    python benchmarks/console/watched.py FOLDER-OR-SOCKET JSON

It ends with SIGTERM, and writes to JSON, all in ms: `redraws`, from the beginning of a look at the view to the last
byte of what the screen wrote because of it; `stalls`, how late its own loop took notice that 5 ms were over: as long
may a key have waited; `texts` and `plots`, of the console's own work.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
import rig.console.session
from rig.console.app import ConsoleApp
from rig.console.feed import SocketFeed
from rig.console.stop_at_once import OperatorDriver
from rig.link.live_runs import find_run
from rig.link.sockets import connect

BEAT = 0.005
"""s between two looks of the loop at the clock."""


@dataclass
class Stopwatch:
    """s on the monotonic clock; lists of ms."""

    begun: float | None = None
    written: float = 0.0
    redraws: list[float] = field(default_factory=list)
    stalls: list[float] = field(default_factory=list)
    texts: list[float] = field(default_factory=list)
    plots: list[float] = field(default_factory=list)

    def around(self, work: Callable[[], None], kept: list[float]) -> Callable[[], None]:
        def timed() -> None:
            now = time.monotonic()
            if self.begun is not None and self.written > self.begun:
                self.redraws.append(1e3 * (self.written - self.begun))
            self.begun = now
            work()
            kept.append(1e3 * (time.monotonic() - now))

        return timed

    async def beat(self) -> None:
        """Until it is cancelled."""
        while True:
            due = time.monotonic() + BEAT
            await asyncio.sleep(BEAT)
            self.stalls.append(1e3 * (time.monotonic() - due))


WATCH = Stopwatch()


class TimedDriver(OperatorDriver):
    """The console's own, which notes when it has written."""

    def write(self, data: str) -> None:
        OperatorDriver.write(self, data)
        WATCH.written = time.monotonic()


async def sit(place: Path) -> None:
    """Until a signal ends it."""
    peer = connect(place if place.is_socket() else Path(find_run(place).socket), "the controller")
    rig.console.session.OperatorDriver = TimedDriver  # type: ignore[misc]
    app = ConsoleApp(SocketFeed(peer), time.monotonic, silent=True)
    app.show_text = WATCH.around(app.show_text, WATCH.texts)  # type: ignore[method-assign]
    app.show_plots = WATCH.around(app.show_plots, WATCH.plots)  # type: ignore[method-assign]
    beating = asyncio.create_task(WATCH.beat())
    await rig.console.session._sit(app, browser=False)
    beating.cancel()


def main(place: str, kept: str) -> None:
    asyncio.run(sit(Path(place)))
    figures = {name: getattr(WATCH, name) for name in ("redraws", "stalls", "texts", "plots")}
    Path(kept).write_text(json.dumps(figures), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
