"""A real server and real console processes on a played controller: the way in, attacks, keys, every way to an end."""

from __future__ import annotations

import asyncio
import os
import signal
from dataclasses import replace

import aiohttp
import pytest

from rig.serve.server import MOST_SESSIONS, NOTHING
from tests.rig.console.feeds import running
from tests.rig.serve.played import CTRL_C, F5, F9, STOP_PRESS, desk, nobody, stranger, until

pytestmark = pytest.mark.timeout(120)


async def test_a_link_lets_in_one_browser_and_is_used_up(tmp_path):
    async with desk(tmp_path) as here, stranger() as second:
        link = here.invite()
        async with here.browser.get(link, allow_redirects=False) as answer:
            assert (answer.status, answer.headers["Location"]) == (303, here.server.guard.room)
            (cookie,) = answer.headers.getall("Set-Cookie")
            assert "HttpOnly" in cookie
            assert "SameSite=Strict" in cookie
            assert f"Path={here.server.guard.room}" in cookie
        async with second.get(link) as answer:
            assert answer.status == 403
            assert "this link has been used" in await answer.text()
        async with here.browser.get(here.room) as answer:
            page = await answer.text()
        assert f"ws://{here.host}{here.server.guard.room}ws" in page
        assert "//fonts" not in page
        policy = answer.headers["Content-Security-Policy"]
        assert f"connect-src 'self' ws://{here.host};" in policy
        assert "frame-ancestors 'none'" in policy
        assert answer.headers["Referrer-Policy"] == "no-referrer"
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        assert any("its link is used up" in line for line in here.said)
        assert here.controller.came == 0


async def test_a_look_at_a_link_does_not_use_it_up(tmp_path):
    """As programs do that show where links lead."""
    async with desk(tmp_path) as here:
        link = here.invite()
        async with here.browser.head(link) as answer:
            assert answer.status == 405
        async with here.browser.get(link) as answer:
            assert answer.status == 200


@pytest.mark.parametrize(
    "place", ["", "ws", "textual/js/textual.js", "page/console.js", "textual/", "download/1", ".."]
)
async def test_nothing_is_served_without_the_cookie(tmp_path, place):
    async with desk(tmp_path) as here:
        async with here.browser.get(here.room + place, headers={"Origin": here.origin}) as answer:
            assert answer.status == 403
            assert (await answer.text()).startswith("Refused: this")
            assert answer.headers["Content-Security-Policy"] == NOTHING
        assert here.controller.came == 0


async def test_what_is_served_with_the_cookie_and_what_is_not(tmp_path):
    async with desk(tmp_path) as here:
        await here.let_in()
        for place, status in {"textual/js/textual.js": 200, "page/console.js": 200, "textual/": 403, "x": 404}.items():
            async with here.browser.get(here.room + place) as answer:
                assert (place, answer.status) == (place, status)
                assert answer.headers["Referrer-Policy"] == "no-referrer"


ATTACKS = {
    "a page of another port": {"Origin": "http://127.0.0.1:9"},
    "a page of the web": {"Origin": "https://evil.example"},
    "a page in a sandbox": {"Origin": "null"},
    "a program without Origin": {"Origin": None},
    "a name that was made to lead here": {"Host": "evil.example", "Origin": "http://evil.example"},
    "without the cookie": {"Cookie": ""},
    "a cookie of its own making": {"Cookie": "rig_console=guessed"},
}


@pytest.mark.parametrize("attack", ATTACKS)
async def test_a_websocket_of_somebody_else_is_refused_and_reaches_no_controller(tmp_path, attack):
    async with desk(tmp_path) as here:
        await here.let_in()
        headers = {"Origin": here.origin, **ATTACKS[attack]}
        sent = {name: value for name, value in headers.items() if value}
        browser = stranger() if "Cookie" in headers else here.browser
        with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
            await browser.ws_connect(f"{here.room}ws", headers=sent)
        if browser is not here.browser:
            await browser.close()
        assert refused.value.status == 403
        assert here.said[-1].startswith("rig: refused a request from 127.0.0.1: ")
        assert here.consoles() == []
        assert (here.controller.came, here.controller.asked) == (0, [])


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS"])
async def test_nothing_is_done_by_anything_but_reading(tmp_path, method):
    async with desk(tmp_path) as here:
        await here.let_in()
        for origin in ("http://127.0.0.1:9", here.origin):
            async with here.browser.request(method, here.room, headers={"Origin": origin}) as answer:
                assert answer.status == 403


async def test_it_looks_on_until_l_and_its_keys_arrive(tmp_path):
    async with desk(tmp_path) as here:
        await here.let_in()
        screen = await here.screen()
        assert here.controller.clients.attending == 0
        await screen.press(F5)
        await screen.until_drawn("This console looks on.")
        assert here.controller.kinds == []
        await screen.press("l")
        await until(lambda: here.controller.clients.attending == 1)
        await screen.press(F5)
        await until(lambda: here.controller.kinds == ["start"])
        await until(lambda: '["alive"]' in screen.texts)
        await screen.close()


@pytest.mark.parametrize("key", [F9, CTRL_C], ids=["F9", "Ctrl+C"])
async def test_the_stop_key_works_while_it_looks_on_and_in_a_text_field(tmp_path, key):
    async with desk(tmp_path, running(attended=True)) as here:
        await here.let_in()
        screen = await here.screen()
        await screen.press(key)
        await until(lambda: here.controller.kinds == STOP_PRESS)
        await screen.press("l")
        await screen.press("n")
        await screen.until_drawn("Note")
        await screen.press(key)
        await until(lambda: here.controller.kinds == [*STOP_PRESS, *STOP_PRESS])
        await screen.close()


async def test_what_a_browser_should_not_say_does_nothing(tmp_path):
    async with desk(tmp_path) as here:
        await here.let_in()
        screen = await here.screen()
        for text in ("", "[[", '["stdin", 3]', '["resize", {"width": "x", "height": 1}]', '["quit"]'):
            await screen.socket.send_str(text)
        await screen.socket.send_bytes(b"\x03")
        await screen.socket.send_json(["resize", {"width": 60, "height": 20}])
        await screen.press(F9)
        await until(lambda: here.controller.kinds == STOP_PRESS)
        await screen.close()


async def test_a_websocket_that_is_closed_ends_its_console(tmp_path):
    async with desk(tmp_path) as here:
        await here.let_in()
        screen = await here.screen()
        await screen.press("l")
        await until(lambda: here.controller.clients.attending == 1)
        await screen.close()
        await until(lambda: not here.controller.clients.connected, 5.0)
        await until(lambda: not here.consoles(), 5.0)


async def test_a_browser_that_answers_no_more_is_gone(tmp_path):
    """Nothing says so; what it was sent is not read."""
    async with desk(tmp_path) as here:
        await here.let_in()
        screen = await here.screen()
        screen.sleep()
        await until(lambda: not here.controller.clients.connected, 10.0)
        await until(lambda: not here.consoles(), 5.0)
        await screen.close()


async def test_a_console_that_hangs_is_killed_once_its_browser_is_gone(tmp_path):
    async with desk(tmp_path) as here:
        await here.let_in()
        screen = await here.screen()
        os.kill(here.consoles()[0], signal.SIGSTOP)
        await screen.close()
        await until(lambda: not here.controller.clients.connected, 10.0)
        await until(lambda: not here.consoles(), 5.0)


async def test_a_console_that_dies_closes_its_page(tmp_path):
    async with desk(tmp_path) as here:
        await here.let_in()
        screen = await here.screen()
        os.kill(here.consoles()[0], signal.SIGKILL)
        await until(lambda: screen.closed, 10.0)


async def test_signals_to_a_console_are_those_of_a_terminal(tmp_path):
    """An interrupt is the stop key, SIGTERM its end."""
    async with desk(tmp_path) as here:
        await here.let_in()
        screen = await here.screen()
        (console,) = here.consoles()
        os.kill(console, signal.SIGINT)
        await until(lambda: here.controller.kinds == ["stop"])
        assert not screen.closed
        os.kill(console, signal.SIGTERM)
        await until(lambda: screen.closed, 10.0)
        await until(lambda: not here.controller.clients.connected, 5.0)


async def test_who_leaves_is_told_that_the_run_goes_on(tmp_path, capfd):
    async with desk(tmp_path) as here:
        await here.let_in()
        screen = await here.screen()
        await screen.press("d")
        await until(lambda: screen.closed)
        await until(lambda: not here.consoles())
    assert f"the run goes on in {tmp_path}; attach again with" in capfd.readouterr().out


async def test_no_more_browsers_than_leave_room_for_a_terminal(tmp_path):
    async with desk(tmp_path) as here:
        await here.let_in()
        screens = [await here.screen() for _ in range(MOST_SESSIONS)]
        with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
            await here.screen()
        assert refused.value.status == 503
        await asyncio.gather(*(screen.close() for screen in screens))


async def test_ctrl_c_on_the_servers_terminal_is_the_stop_key_and_then_the_end(tmp_path):
    async with desk(tmp_path) as here:
        await here.let_in()
        screen = await here.screen()
        os.kill(os.getpid(), signal.SIGINT)
        await until(lambda: here.controller.kinds == ["stop"])
        assert "stop asked" in here.said[-1]
        assert not here.over.done()
        assert not screen.closed
        os.kill(os.getpid(), signal.SIGINT)
        await until(here.over.done)
        assert here.server.ended_by == signal.SIGINT
        assert here.controller.kinds == ["stop"]
        await until(lambda: screen.closed)


async def test_ctrl_c_that_reaches_nobody_says_so(tmp_path):
    async with desk(tmp_path, stop=nobody) as here:
        os.kill(os.getpid(), signal.SIGINT)
        await until(here.over.done)
        assert here.said[-1] == "rig: STOP NOT SENT: the controller is gone"


async def test_a_terminal_that_is_closed_ends_server_and_consoles(tmp_path):
    async with desk(tmp_path) as here:
        await here.let_in()
        screen = await here.screen()
        os.kill(os.getpid(), signal.SIGHUP)
        await until(here.over.done)
        assert here.controller.kinds == []
        await until(lambda: screen.closed)


async def test_it_ends_once_the_run_is_over_and_nobody_looks_on(tmp_path):
    async with desk(tmp_path) as here:
        await here.let_in()
        screen = await here.screen()
        here.server._served = replace(here.server._served, going=lambda: False)
        await asyncio.sleep(1.5)
        assert not here.over.done()
        await screen.close()
        await until(here.over.done, 10.0)
        assert here.server.ended_by == 0


async def test_enter_asks_for_one_more_link(tmp_path):
    async with desk(tmp_path) as here, stranger() as second:
        terminal, keyboard = os.pipe()
        here.server.invite_at_enter(terminal)
        os.write(keyboard, b"\n")
        await until(lambda: "token=" in "".join(here.said[-1:]))
        os.close(keyboard)
        await asyncio.sleep(0.1)
        os.close(terminal)
        async with second.get(here.said[-1]) as answer:
            assert answer.status == 200
