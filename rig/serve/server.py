"""The web server: every request before the guard, a page, and a console process for each websocket."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import textual_serve
from aiohttp import WSMsgType, web
from aiohttp.typedefs import Handler
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from rig.errors import LinkError
from rig.serve.address import link, served_hosts
from rig.serve.browser_session import BrowserSession
from rig.serve.guard import NO_LINK, USED, Asked, Guard
from rig.serve.messages import ALIVE, size

COOKIE: Final = "rig_console"
HEARTBEAT: Final = 2.0
"""s between pings of a browser; half of that later one that does not answer is gone."""
BEAT: Final = 1.0
"""s between signs of life to a browser, and between looks at the run."""
MOST_SESSIONS: Final = 4
"""Of the controller's eight places for front ends: the terminals and `rig stop` keep theirs."""
LONGEST_MESSAGE: Final = 65536
FULL: Final = f"{MOST_SESSIONS} browsers are connected already; close one of them"
ENDING: Final = 60.0
"""s in which consoles that have left still write their fits and page, when the server ends."""
PAGE: Final = Path(__file__).parent / "page"
SCRIPTS: Final = Path(textual_serve.__file__).parent / "static"
HEADERS: Final = {
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Server": "rig",
}
NOTHING: Final = "default-src 'none'; frame-ancestors 'none'"
POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; font-src 'self'; "
    "connect-src 'self' ws://{host}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""xterm.js makes style elements of its own. Nothing is fetched from anywhere else."""


@dataclass(frozen=True, slots=True)
class Served:
    """What is served, and what the server may do besides."""

    command: Sequence[str]
    """Starts a console process."""
    title: str
    stop: Callable[[], None]
    """The stop key of the server's own terminal. Raises LinkError when there is nobody to be stopped."""
    going: Callable[[], bool]
    """Whether the run still goes on."""
    say: Callable[[str], None]
    """To whoever started the server."""


class ConsoleServer:
    """Lives in one event loop, until the run is over and nobody looks on any more, or it is told to end."""

    def __init__(self, served: Served, listener: socket.socket) -> None:
        """Owns `listener`, which listens already."""
        self.guard = Guard()
        self.ended_by = 0
        """The signal that ended it; 0: none did."""
        self._served, self._listener = served, listener
        self._address, self._port = listener.getsockname()[:2]
        self._name = socket.gethostname()
        self._sockets: set[web.WebSocketResponse] = set()
        self._over = asyncio.Event()
        self._stop_sent = False
        self._template = Environment(
            loader=FileSystemLoader(PAGE), autoescape=True, undefined=StrictUndefined
        ).get_template("console.html")

    async def run(self) -> None:
        """Serve until the end; every session's process has ended then."""
        runner = web.AppRunner(self._application(), access_log=None, shutdown_timeout=ENDING)
        loop = asyncio.get_running_loop()
        loop.add_signal_handler(signal.SIGINT, self.interrupt)
        for number in (signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(number, self.end, number)
        await runner.setup()
        await web.SockSite(runner, self._listener).start()
        looking = asyncio.create_task(self._look_at_the_run())
        try:
            await self._over.wait()
        finally:
            looking.cancel()
            await runner.cleanup()

    def invite(self) -> None:
        """Print a link for one more browser."""
        self._served.say(link(self._address, self._port, self._name, self.guard.new_token()))

    def invite_at_enter(self, keyboard: int) -> None:
        """From now on each line that comes from that descriptor asks for one more link."""
        loop = asyncio.get_running_loop()

        def line() -> None:
            if os.read(keyboard, 4096):
                self.invite()
            else:
                loop.remove_reader(keyboard)

        loop.add_reader(keyboard, line)

    def interrupt(self) -> None:
        """Ctrl+C: the stop key here too, and the second time the end."""
        if self._stop_sent:
            self.end(signal.SIGINT)
            return
        self._stop_sent = True
        try:
            self._served.stop()
        except LinkError as error:
            self._served.say(f"rig: STOP NOT SENT: {error}")
            self.end(signal.SIGINT)
        else:
            self._served.say("rig: stop asked; whether the propeller is at rest, the consoles say. Ctrl+C again: end")

    def end(self, number: signal.Signals) -> None:
        self.ended_by = number
        self._over.set()

    async def _look_at_the_run(self) -> None:
        while self._served.going() or self._sockets:
            await asyncio.sleep(BEAT)
        self._over.set()

    def _application(self) -> web.Application:
        application = web.Application(middlewares=[self._guarded])
        room = self.guard.room
        application.add_routes(
            [
                web.get("/", self._enter, allow_head=False),
                web.get(room, self._page),
                web.get(f"{room}ws", self._console, allow_head=False),
                web.static(f"{room}textual", SCRIPTS),
                web.static(f"{room}page", PAGE),
            ]
        )
        application.on_response_prepare.append(_harden)
        application.on_shutdown.append(self._hang_up)
        return application

    @web.middleware
    async def _guarded(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        asked = Asked(
            method=request.method,
            path=request.path,
            host=request.headers.get("Host", ""),
            origin=request.headers.get("Origin"),
            cookie=request.cookies.get(COOKIE, ""),
            websocket="Upgrade" in request.headers or request.path == f"{self.guard.room}ws",
        )
        reason = self.guard.refusal(asked, self._hosts(request))
        return self._refused(request, reason) if reason else await handler(request)

    def _hosts(self, request: web.Request) -> frozenset[str]:
        assert request.transport is not None
        address, port = request.transport.get_extra_info("sockname")[:2]
        return served_hosts(address, port, self._name)

    def _refused(self, request: web.Request, reason: str, status: int = 403) -> web.Response:
        self._served.say(f"rig: refused a request from {request.remote}: {reason}")
        return web.Response(status=status, text=f"Refused: {reason}.\n")

    async def _enter(self, request: web.Request) -> web.StreamResponse:
        """A link becomes a cookie."""
        token = request.query.get("token", "")
        cookie = self.guard.exchange(token) if token else None
        if cookie is None:
            return self._refused(request, USED if token else NO_LINK)
        self._served.say(f"rig: a browser at {request.remote} was let in; its link is used up")
        answer = web.Response(status=303, headers={"Location": self.guard.room})
        answer.set_cookie(COOKIE, cookie, path=self.guard.room, httponly=True, samesite="Strict")
        return answer

    async def _page(self, request: web.Request) -> web.StreamResponse:
        host = request.host.lower()
        text = self._template.render(title=self._served.title, websocket=f"ws://{host}{self.guard.room}ws")
        answer = web.Response(text=text, content_type="text/html")
        answer.headers["Content-Security-Policy"] = POLICY.format(host=host)
        return answer

    async def _console(self, request: web.Request) -> web.StreamResponse:
        """One browser's console, from its first key to its end."""
        if len(self._sockets) >= MOST_SESSIONS:
            return self._refused(request, FULL, 503)
        websocket = web.WebSocketResponse(heartbeat=HEARTBEAT, max_msg_size=LONGEST_MESSAGE)
        session = BrowserSession(self._served.command, websocket)
        self._sockets.add(websocket)
        beating = asyncio.create_task(_beat(websocket))
        try:
            await websocket.prepare(request)
            await session.start(*size(_cells(request, "width", 80), _cells(request, "height", 24)))
            async for message in websocket:
                if message.type == WSMsgType.TEXT:
                    await session.hear(message.data)
        finally:
            beating.cancel()
            await session.stop()
            self._sockets.discard(websocket)
        return websocket

    async def _hang_up(self, _: web.Application) -> None:
        for websocket in list(self._sockets):
            await websocket.close()


async def _harden(_: web.Request, response: web.StreamResponse) -> None:
    response.headers.update(HEADERS)
    response.headers.setdefault("Content-Security-Policy", NOTHING)


async def _beat(websocket: web.WebSocketResponse) -> None:
    with contextlib.suppress(ConnectionError):
        while not websocket.closed:
            await asyncio.sleep(BEAT)
            await websocket.send_str(ALIVE)


def _cells(request: web.Request, name: str, default: int) -> int:
    text = request.query.get(name, "")
    return int(text) if text.isdecimal() and len(text) < 6 else default


def serve(served: Served, listener: socket.socket, keyboard: int | None = None) -> int:
    """Serve until the run is over and nobody looks on, or a signal; that signal, 0: none. `keyboard`: a descriptor
    whose lines ask for another link. Every console process has ended then."""

    async def sit() -> int:
        server = ConsoleServer(served, listener)
        server.invite()
        if keyboard is not None:
            server.invite_at_enter(keyboard)
        await server.run()
        return server.ended_by

    return asyncio.run(sit())
