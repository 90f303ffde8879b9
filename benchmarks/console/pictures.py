"""Every screen of the console and of the editor at any size, as SVG and as one page to look at.

    python benchmarks/console/pictures.py FOLDER [--size 160x48] [--colors full|16|none] [--png]

The scenes are those that tests/rig/console compares with accepted pictures. `--png` draws each with headless Chromium,
where there is one. `FOLDER/index.html` shows them side by side.
"""

from __future__ import annotations

import argparse
import asyncio
import html
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

from textual.app import App
from textual.pilot import Pilot

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from tests.rig.console import scenes
from tests.rig.console.editor import editor_desk

Play = Callable[[Pilot[Any]], Awaitable[None]]
CELL = 12.2, 24.4
"""Pixels of a character in Textual's SVG, and its frame besides."""
FRAME = 20, 60


def every(colors: str) -> Iterator[tuple[str, App[Any], Play]]:
    """(name, application, what is done before the picture)."""
    for name, scene in scenes.SCENES.items():
        app, play = scenes.prepare(scene, colors)
        yield name, app, play
    for name, keys in editor_desk.SCENES.items():
        yield f"edit_{name}", editor_desk.editor(editor_desk.campaign_here(), colors), _typed(keys)


def _typed(keys: Any) -> Play:
    return lambda pilot: editor_desk.play(pilot, *keys)


async def picture(app: App[Any], play: Play, size: tuple[int, int]) -> str:
    async with app.run_test(size=size) as pilot:
        await play(pilot)
        await pilot.pause()
        return app.export_screenshot()


def drawn(svg: Path, size: tuple[int, int]) -> None:
    """The same as PNG."""
    width, height = (round(n * cell + frame) for n, cell, frame in zip(size, CELL, FRAME, strict=True))
    subprocess.run(
        [
            *("chromium", "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run"),
            f"--window-size={width},{height}",
            f"--screenshot={svg.with_suffix('.png')}",
            svg.as_uri(),
        ],
        check=True,
        capture_output=True,
        timeout=60,
    )


def page(names: list[str], ending: str) -> str:
    """All of them, two in a row."""
    figures = "".join(
        f'<figure><img src="{html.escape(name)}{ending}" alt=""><figcaption>{html.escape(name)}</figcaption></figure>'
        for name in names
    )
    style = "body{display:grid;grid-template-columns:1fr 1fr;gap:8px}img{width:100%}figure{margin:0}"
    return f"<!doctype html><title>rig console</title><style>{style}</style>{figures}"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--size", default="160x48", help="columns x rows")
    parser.add_argument("--colors", choices=("full", "16", "none"), default="full")
    parser.add_argument("--png", action="store_true")
    asked = parser.parse_args()
    columns, _, rows = asked.size.partition("x")
    size = int(columns), int(rows)
    folder = asked.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    names = []
    with tempfile.TemporaryDirectory() as here:
        os.chdir(here)  # the editor writes its campaign where it is
        for name, app, play in every(asked.colors):
            path = folder / f"{name}.svg"
            path.write_text(asyncio.run(picture(app, play, size)))
            if asked.png and shutil.which("chromium"):
                drawn(path, size)
            names.append(name)
        os.chdir(folder)
    (folder / "index.html").write_text(page(names, ".png" if asked.png and shutil.which("chromium") else ".svg"))
    print(f"{len(names)} screens of {asked.size}: {folder / 'index.html'}")


if __name__ == "__main__":
    main()
