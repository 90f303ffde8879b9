"""An editor on a campaign file in the present folder, as the tests press its keys, and the scenes of its pictures."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

from textual.pilot import Pilot
from textual.widgets import Button, Static

from rig.console.editor.app import EditorApp
from rig.console.editor.form import Row
from rig.console.editor.preview import CommandPlot
from rig.editing.draft import Draft
from rig.editing.saving import opened
from rig.operate.edit import assessor

WRONG = Path(__file__).parents[2] / "wrong"
CAMPAIGN = """\
# The new propeller, before the summer.
[campaign]
name = "tank"              # names the folder
bench = "bench.toml"
thrusters = ["T1", "T2"]   # left, right
output = "recordings"
expected_C = 0.4           # N/V^2

[plan]
kind = "staircase"         # shows hysteresis
max = 16.0                 # V
levels = 4                 # per sign
slew = 10.0                # V/s
[plan.dwell]
kind = "fixed"
duration = 3.0             # s
"""


def campaign_here(text: str = CAMPAIGN) -> Path:
    Path("bench.toml").write_text((WRONG / "right_bench.toml").read_text(encoding="utf-8"), encoding="utf-8")
    path = Path("campaign.toml")
    path.write_text(text, encoding="utf-8")
    return path


def editor(path: Path, colors: str = "full") -> EditorApp:
    return EditorApp(Draft(opened(path)), assessor(path), colors=colors)


@dataclass
class Desk:
    app: EditorApp
    pilot: Pilot[None]
    path: Path

    async def press(self, *keys: str) -> None:
        await self.pilot.press(*keys)

    async def enter(self, key: str) -> Row:
        """Go into a field, whatever is before it."""
        row = self.row(key)
        row.control.focus()
        await self.pilot.pause()
        return row

    def row(self, key: str) -> Row:
        return next(row for row in self.app.form.rows() if row.field.dotted == key)

    async def look(self) -> None:
        """Make the dry run now instead of when the typing has paused."""
        self.app.look()
        await self.pilot.pause()

    @property
    def text(self) -> str:
        """What would be saved."""
        return self.app.draft.document.text

    @property
    def disk(self) -> str:
        return self.path.read_text(encoding="utf-8")

    def told(self) -> str:
        """Problem, or the numbers of the dry run."""
        return self.app.found.problem or "\n".join(f"{what}: {said}" for what, said in self.app.found.rows)

    def wrong(self) -> list[str]:
        """Keys that are marked."""
        return [row.field.dotted for row in self.app.form.rows() if row.has_class("wrong")]

    def head(self) -> str:
        return str(self.app.screen_stack[0].query_one("#head", Static).render())

    def answers(self) -> list[str]:
        """Of the dialog that is open."""
        return [str(button.id) for button in self.app.screen.query(Button)]

    def toasts(self) -> list[str]:
        return [notification.message for notification in self.app._notifications]


@asynccontextmanager
async def editing(path: Path, size: tuple[int, int] = (80, 24)) -> AsyncIterator[Desk]:
    app = editor(path)
    async with app.run_test(size=size) as pilot:
        yield Desk(app, pilot, path)


SCENES = {
    "opened": (),
    "limit": ("down", *"30"),
    "unfinished": ("right", "right", "right"),
    "levels": ("right", "right", "right", *(["down"] * 1), *"4, 0, -4, 12, -12"),
    "no_number": ("down", *"12x", "down", *"2.5"),
    "leave": ("down", *"12", "ctrl+q"),
    "keys": ("f1",),
}
"""Keys from the first field of the plan on."""


async def play(pilot: Pilot[None], *keys: str) -> None:
    app = pilot.app
    assert isinstance(app, EditorApp)
    await pilot.press(*keys)
    for _ in range(3):
        app.look()
        await pilot.pause()
    app.screen_stack[0].query_one(CommandPlot).refresh()
    await pilot.wait_for_scheduled_animations()
    await pilot.pause()
