"""`python -m tests.rig.console.photograph FOLDER`: a real run as `console-preflight.svg`, `-sweep`, `-end`.

The console runs without a terminal, in this process; controller, recorder and simulated bench are the real ones, in
theirs. `tests.rig.console.render` draws the same screens from made-up snapshots, the same every time.
"""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from textual.pilot import Pilot

from rig.console.app import ConsoleApp
from rig.console.feed import SocketFeed
from rig.link.front_end_messages import Snapshot
from rig.link.live_runs import Run
from rig.link.sockets import connect
from rig.operate.run import start_controller
from tests.reliability.live import PROJECT, live_bench
from tests.rig.console.scenes import settle, show

SIZE = (120, 40)
HOLDS = 17
"""Of T1 that the picture of the sweep shows."""


async def photograph(run: Run, folder: Path) -> None:
    """Walk through a campaign from preflight to end."""
    app = ConsoleApp(SocketFeed(connect(Path(run.socket), "the controller")), time.monotonic)

    async def take(name: str, pilot: Pilot[None], wanted: Callable[[Snapshot], bool]) -> None:
        def reached() -> bool:
            return app.state.snapshot is not None and wanted(app.state.snapshot)

        await settle(pilot, reached)
        await show(pilot, app)
        while not reached():  # the bench went on while the screen was drawn
            await settle(pilot, reached)
            await show(pilot, app)
        picture = app.export_screenshot(title=ConsoleApp.TITLE)
        (folder / f"console-{name}.svg").write_text(picture, encoding="utf-8")

    async with app.run_test(size=SIZE) as pilot:
        await take("preflight", pilot, lambda s: s.state == "preflight" and len(s.checks) > 5)
        await pilot.press("f5")
        await take("sweep", pilot, lambda s: s.thruster == "T3" and s.state == "hold" and len(s.points) > HOLDS)
        await take("end", pilot, lambda s: s.state == "done")
        await pilot.press("d")
    app.feed.close()


def main(folder: str) -> None:
    with TemporaryDirectory(prefix="tunnel-") as bench, live_bench(Path(bench)):
        campaign = Path(bench) / "campaign.toml"
        text = (PROJECT / "campaigns/demo.toml").read_text().replace("../benches/simulated/", "")
        campaign.write_text(text.replace("levels = 4", "levels = 12").replace('name = "demo"', 'name = "tunnel demo"'))
        out = Path(bench) / "recordings"
        out.mkdir()
        run, process = start_controller(campaign, out, ())
        asyncio.run(photograph(run, Path(folder)))
        process.wait(20)


if __name__ == "__main__":
    main(*sys.argv[1:])
