"""The same in headless Chromium by `rig console --serve`, with an attacker's page open in the same browser."""

from __future__ import annotations

import asyncio
import re
import time
from pathlib import Path

from benchmarks.operating.at_keys import DayError, Operator
from benchmarks.operating.one_day import READY
from benchmarks.operating.place import Place
from benchmarks.operating.preparing import STOP_WITHIN
from tests.rig.serve.chromium import Page, chromium
from tests.rig.serve.test_chromium import ATTACK, READ, another_site

LINK = re.compile(r"http://127\.0\.0\.1:\d+/\?token=\S+")


async def in_browser(first: Operator, server: Operator, place: Place, pictures: Path) -> None:
    """`first` starts the run and leaves; `server` is the terminal of `rig console --serve`."""
    transcript = first.transcript
    transcript.chapter(
        "A browser: read-only, the page of another origin refused, then start, note, mark and stop there"
    )
    first.types("clear; rig run campaign.toml --no-report; echo status=$?", "the preflight passes", READY)
    serve = f"rig console --serve --port 0 --no-report {place.campaign}"
    screen = server.types(f"clear; {serve}; echo status=$?", "a link", LINK.pattern)
    link = LINK.search(screen)
    assert link is not None
    async with chromium(pictures / "profile") as browser, another_site() as (site, _):
        seat = Seat(await browser.tab(), first, pictures)
        await seat.page.open(link[0])
        await seat.sees("it looks on", "READ-ONLY")
        room = await seat.page.run("location.href")
        begun = time.monotonic_ns()
        await seat.presses("F5", "refused", "This console looks on.")
        evil = await browser.tab()
        await evil.open(site)
        await evil.until("document.body && document.body.innerText === 'free games'")
        if (
            await evil.run(ATTACK % f"{room.replace('http', 'ws')}ws") != "refused"
            or await evil.run(READ % room) != "refused"
        ):
            raise DayError("the page of another origin was not refused")
        server.sees("the other page is refused", "refused a request", re.escape(site.rstrip("/")))
        if place.driven(begun):
            raise DayError("a page of another origin has started the motor")
        transcript.fact("by the truth log: the page of another origin has started nothing")
        await seat.presses("l", "it attends", "attended")
        first.presses("d", "what leaving does", "The campaign goes on without this console")
        first.presses("Tab", "from one button to the other", "Leave, campaign goes on")
        first.presses("Enter", "left", "the run goes on in", within=30.0)
        await seat.presses("F5", "started", "hold")
        await asyncio.to_thread(place.until_driven)
        await seat.presses("4", "all events", "events of this run")
        await seat.presses("n", "the dialog", "Note for the recording")
        for letter in "kelp":
            await seat.page.press(letter)
        await seat.presses("Enter", "kept", "kelp")
        await asyncio.to_thread(place.until_driven)
        await seat.presses("a", "a step is measured", "ended early on request")
        await seat.presses("m", "marked", "marked bad by the operator")
        pressed = time.monotonic_ns()
        await seat.presses("F9", "stopped", "ABORTED")
        await asyncio.to_thread(place.zero_after, pressed, STOP_WITHIN)
        await seat.page.press("d")
        await seat.page.until("getComputedStyle(document.querySelector('#closed')).display === 'block'")
        transcript.step("browser", "d", "the page says that its console has ended", ("#closed is shown",), "")
        server.sees("the server ends by itself", "status=0", within=60.0)


class Seat:
    """In front of one page."""

    def __init__(self, page: Page, operator: Operator, pictures: Path) -> None:
        self.page, self._transcript, self._pictures = page, operator.transcript, pictures
        self._count = 0

    async def presses(self, key: str, says: str, *drawn: str) -> None:
        """One key, and what the console draws then."""
        since = len(self.page.frames)
        await self.page.press(key)
        await self._until(key, says, drawn, since)

    async def sees(self, says: str, *drawn: str) -> None:
        await self._until("", says, drawn, 0)

    async def _until(self, key: str, says: str, drawn: tuple[str, ...], since: int) -> None:
        for text in drawn:
            await self.page.until_drawn(text, since=since)
        self._count += 1
        picture = self._pictures / f"browser-{self._count:02}.png"
        await self.page.picture(picture)
        self._transcript.step("browser", key, says, drawn, f"(picture {picture.name})")
