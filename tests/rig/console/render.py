"""`python -m tests.rig.console.render FILE.svg [SCENE] [WIDTH] [HEIGHT]`: a picture of the console, always the same.

The README's picture: `python -m tests.rig.console.render docs/images/console.svg`."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

from rig.console.app import ConsoleApp
from tests.rig.console.scenes import SCENES, prepare


async def render(scene: str, size: tuple[int, int]) -> str:
    app, play = prepare(SCENES[scene])
    async with app.run_test(size=size) as pilot:
        await play(pilot)
        return app.export_screenshot(title=ConsoleApp.TITLE)


def main(path: str, scene: str = "sweep", width: str = "140", height: str = "42") -> None:
    Path(path).write_text(asyncio.run(render(scene, (int(width), int(height)))), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
