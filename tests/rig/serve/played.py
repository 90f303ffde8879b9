"""A run whose controller is the real listening socket and a feed of one snapshot, and a real server on it."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import aiohttp

from rig.errors import LinkError
from rig.link.clients import Clients
from rig.link.front_end_messages import Request, Snapshot
from rig.link.live_runs import Run, register
from rig.link.sockets import listen as listen_locally
from rig.serve.address import listen
from rig.serve.server import ConsoleServer, Served
from tests.rig.console.feeds import snapshot

PATIENCE = 40.0
"""s until something must have come about, on a busy machine."""
STOP_PRESS = ["stop", "stop"]
"""What one press of a stop key asks: in the thread that reads the keys, and again in the screen's own loop."""
F5, F9, CTRL_C = "\x1b[15~", "\x1b[20~", "\x03"


@dataclass
class PlayedController:
    """Publishes one snapshot ten times a second, and keeps what it is asked."""

    run: Run
    clients: Clients
    shown: Snapshot
    asked: list[Request] = field(default_factory=list)
    came: int = 0
    """The most front ends that were connected at once."""

    async def live(self) -> None:
        loop = asyncio.get_running_loop()
        for seq in range(10**9):
            self.asked += self.clients.poll(loop.time())
            self.came = max(self.came, len(self.clients.connected))
            self.clients.publish(replace(self.shown, seq=seq))
            await asyncio.sleep(0.1)

    @property
    def kinds(self) -> list[str]:
        return [request.kind for request in self.asked]


@asynccontextmanager
async def controller(folder: Path, shown: Snapshot) -> AsyncIterator[PlayedController]:
    """One that is found by `find_run`, in this process."""
    listener = listen_locally(folder / "controller.sock")
    run = Run(os.getpid(), str(folder / "controller.sock"), str(folder), "campaign", "bench")
    file = register(run)
    played = PlayedController(run, Clients(listener), shown)
    living = asyncio.create_task(played.live())
    try:
        yield played
    finally:
        living.cancel()
        played.clients.close()
        file.unlink()


async def until(true: Callable[[], object], patience: float = PATIENCE) -> None:
    """Wait until it is."""
    async with asyncio.timeout(patience):
        while not true():
            await asyncio.sleep(0.02)


class Screen:
    """A browser's side of the websocket: what came, and keys."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self.socket = socket
        self.drawn = ""
        self.texts: list[str] = []
        self._reading = asyncio.create_task(self._read())

    async def _read(self) -> None:
        async for message in self.socket:
            if message.type == aiohttp.WSMsgType.BINARY:
                self.drawn += message.data.decode(errors="replace")
            elif message.type == aiohttp.WSMsgType.TEXT:
                self.texts.append(message.data)

    @property
    def closed(self) -> bool:
        return self._reading.done()

    async def until_drawn(self, text: str) -> None:
        await until(lambda: text in self.drawn)

    async def press(self, keys: str) -> None:
        await self.socket.send_json(["stdin", keys])

    def sleep(self) -> None:
        """As a laptop whose lid is closed: it reads nothing more and answers no ping."""
        self._reading.cancel()

    async def close(self) -> None:
        await self.socket.close()
        await asyncio.wait([self._reading])


@dataclass
class Desk:
    """A server on a played controller, and a browser."""

    controller: PlayedController
    server: ConsoleServer
    browser: aiohttp.ClientSession
    said: list[str]
    host: str
    """127.0.0.1 and the port."""
    over: asyncio.Task[None]

    @property
    def origin(self) -> str:
        return f"http://{self.host}"

    @property
    def room(self) -> str:
        return self.origin + self.server.guard.room

    def invite(self) -> str:
        """One more link."""
        self.server.invite()
        return self.said[-1]

    async def let_in(self) -> None:
        async with self.browser.get(self.invite()) as answer:
            assert (answer.status, str(answer.url)) == (200, self.room)

    async def screen(self) -> Screen:
        """A console that has drawn its first screen."""
        socket = await self.browser.ws_connect(f"{self.room}ws?width=100&height=30", origin=self.origin)
        screen = Screen(socket)
        await screen.until_drawn("READ-ONLY")
        return screen

    def consoles(self) -> list[int]:
        """Process numbers of the consoles that live."""
        return seats(self.controller.run.folder)


def seats(folder: str) -> list[int]:
    """Process numbers of the browsers' consoles on the run in that folder."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            words = (entry / "cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if b"rig.serve.seat" in words and folder.encode() in words:
            found.append(int(entry.name))
    return found


def stranger() -> aiohttp.ClientSession:
    """A browser without any cookie."""
    return aiohttp.ClientSession(cookie_jar=aiohttp.CookieJar(unsafe=True))  # takes cookies of an IP address


@asynccontextmanager
async def desk(
    folder: Path, shown: Snapshot | None = None, stop: Callable[[], None] | None = None
) -> AsyncIterator[Desk]:
    """A server, and a browser that was not let in yet. At the end no console's process is left."""
    said: list[str] = []
    listener = listen("127.0.0.1", 0)
    async with controller(folder, shown or snapshot(attended=True)) as played, stranger() as browser:
        command = [sys.executable, "-m", "rig.serve.seat", str(folder), "full", "no-report"]
        asked = stop or (lambda: played.asked.append(Request("stop", "the server")))
        served = Served(command, "rig console of a test", asked, lambda: True, said.append)
        server = ConsoleServer(served, listener)
        over = asyncio.create_task(server.run())
        here = Desk(played, server, browser, said, f"127.0.0.1:{listener.getsockname()[1]}", over)
        try:
            async with browser.get(here.origin) as answer:  # it is there, and minds the signals
                assert answer.status == 403
            yield here
        finally:
            server.end(signal.SIGTERM)
            await over
            assert here.consoles() == []


def nobody() -> None:
    raise LinkError("the controller is gone")
