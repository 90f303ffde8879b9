"""In headless Chromium: an operator's browser, and the page of an attacker that is open in the same one."""

from __future__ import annotations

import os
import signal
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from urllib.parse import urlsplit

import pytest
from aiohttp import web

from tests.rig.console.feeds import running
from tests.rig.serve.chromium import CHROMIUM, CTRL, chromium
from tests.rig.serve.played import STOP_PRESS, desk, until

pytestmark = [
    pytest.mark.timeout(240),
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine (Debian: apt install chromium)"),
]

ATTACK = """new Promise((resolve) => {
  const socket = new WebSocket(%r);
  socket.onopen = () => { socket.send('["stdin", "l"]'); socket.send('["stdin", "\\\\u001b[15~"]'); resolve("open"); };
  socket.onerror = () => resolve("refused");
})"""
READ = 'fetch(%r, {credentials: "include"}).then((answer) => answer.text(), () => "refused")'
SENT = 'fetch(%r, {credentials: "include", mode: "no-cors", method: %r}).then((a) => a.type, () => "refused")'
FRAME = """new Promise((resolve) => {
  const frame = document.createElement("iframe");
  frame.onload = () => { try { frame.contentWindow.document.body; resolve("read"); } catch { resolve("closed"); } };
  frame.src = %r;
  document.body.append(frame);
})"""


@asynccontextmanager
async def another_site() -> AsyncIterator[tuple[str, list[str]]]:
    """A page of another port of this host, and the cookies that it is sent."""
    cookies: list[str] = []

    async def page(request: web.Request) -> web.Response:
        cookies.append(request.headers.get("Cookie", ""))
        return web.Response(text="<body>free games</body>", content_type="text/html")

    application = web.Application()
    application.router.add_get("/{any:.*}", page)
    runner = web.AppRunner(application)
    await runner.setup()
    site = web.TCPSite(runner, "127.0.0.1", 0)
    await site.start()
    try:
        yield f"http://127.0.0.1:{runner.addresses[0][1]}/", cookies
    finally:
        await runner.cleanup()


async def test_keys_of_a_browser_reach_the_controller_and_nothing_is_fetched_elsewhere(tmp_path):
    async with desk(tmp_path) as here, chromium(tmp_path / "profile") as browser:
        page = await browser.tab()
        await page.open(here.invite())
        await page.until_drawn("READ-ONLY")
        assert await page.run("location.href") == here.room
        await page.press("F5")
        await page.until_drawn("This console looks on.")  # and the page was not loaded anew
        assert here.controller.kinds == []
        await page.press("l")
        await until(lambda: here.controller.clients.attending == 1)
        await page.run("document.activeElement.blur()")
        await page.press("F5")
        await until(lambda: here.controller.kinds == ["start"])
        await page.press("F9")
        await page.press("c", CTRL)
        await until(lambda: here.controller.kinds == ["start", *STOP_PRESS, *STOP_PRESS])
        assert {urlsplit(url).netloc for url in page.fetched if not url.startswith("data:")} == {here.host}
        assert await page.run("document.fonts.check('16px \"Roboto Mono\"')")
        await page.open("about:blank")
        await until(lambda: not here.controller.clients.connected, 10.0)


async def test_a_page_that_hears_nothing_says_so_and_one_whose_console_ended_too(tmp_path):
    async with desk(tmp_path, running(attended=True)) as here, chromium(tmp_path / "profile") as browser:
        page = await browser.tab()
        await page.open(here.invite())
        await page.until_drawn("READ-ONLY")
        shown = "getComputedStyle(document.querySelector('#%s')).display"
        assert await page.run(shown % "silent") == await page.run(shown % "closed") == "none"
        (console,) = here.consoles()
        os.kill(console, signal.SIGSTOP)  # now the signs of life alone come
        await page.until(f"(last -= 10000, {shown % 'silent'} === 'block')")
        os.kill(console, signal.SIGCONT)
        await page.until(f"{shown % 'silent'} === 'none'")  # the next sign of life
        await page.press("d")
        await page.until(f"{shown % 'closed'} === 'block'")
        assert "No key of this page does anything" in await page.run("document.querySelector('#closed').innerText")


async def test_a_page_of_another_origin_in_the_same_browser_gets_nowhere(tmp_path):
    """It even knows the secret path, and the browser was let in."""
    async with desk(tmp_path) as here, chromium(tmp_path / "profile") as browser, another_site() as (site, cookies):
        page = await browser.tab()
        await page.open(here.invite())
        await page.until_drawn("READ-ONLY")
        assert (len(here.consoles()), here.controller.came) == (1, 1)
        evil = await browser.tab()
        await evil.open(site)
        await evil.until("document.body && document.body.innerText === 'free games'")
        assert await evil.run(ATTACK % f"ws://{here.host}{here.server.guard.room}ws") == "refused"
        assert f"comes from a page of '{site[:-1]}'" in here.said[-1]
        assert await evil.run(READ % here.room) == "refused"
        assert await evil.run(SENT % (here.room, "POST")) in ("refused", "opaque")
        assert f"comes from a page of '{site[:-1]}'" in here.said[-1]
        assert await evil.run(FRAME % here.room) == "closed"
        assert await evil.run(SENT % (f"{here.origin}/", "GET")) in ("refused", "opaque")
        await evil.open(f"{site}anything")
        await evil.until("location.pathname === '/anything'")
        assert not any("rig_console" in cookie for cookie in cookies)
        assert (len(here.consoles()), here.controller.came) == (1, 1)
        assert here.controller.kinds == []
        await page.press("F9")  # the operator's own page is as it was
        await until(lambda: here.controller.kinds == STOP_PRESS)


async def test_a_second_browser_with_the_same_link_is_refused(tmp_path):
    async with (
        desk(tmp_path) as here,
        chromium(tmp_path / "one") as browser,
        chromium(tmp_path / "other") as other,
    ):
        link = here.invite()
        page = await browser.tab()
        await page.open(link)
        await page.until_drawn("READ-ONLY")
        late = await other.tab()
        await late.open(link)
        await late.until("document.body && document.body.innerText.includes('this link has been used')")
        assert here.controller.came == 1
