"""Headless Chromium over the DevTools protocol: as much as an operator and an attacker need. No driver besides."""

from __future__ import annotations

import asyncio
import base64
import itertools
import os
import shutil
import signal
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import aiohttp

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--no-first-run",
    "--remote-debugging-port=0",
    "--window-size=1300,800",
)
PATIENCE = 60.0
"""s for anything to come about."""
KEYS = {"F5": 116, "F9": 120, "Enter": 13}
"""Virtual key codes, which xterm.js reads; that of a letter or digit is its capital's."""
CTRL = 2


class Page:
    """One tab."""

    def __init__(self, connection: aiohttp.ClientWebSocketResponse) -> None:
        self._connection = connection
        self._numbers = itertools.count(1)
        self.fetched: list[str] = []
        """Addresses of all requests so far."""
        self.frames: list[str] = []
        """What came over its websockets, decoded."""

    async def call(self, method: str, **parameters: object) -> dict[str, Any]:
        """One command and its result."""
        number = next(self._numbers)
        await self._connection.send_json({"id": number, "method": method, "params": parameters})
        while True:
            message = await asyncio.wait_for(self._connection.receive_json(), PATIENCE)
            if message.get("id") == number:
                assert "error" not in message, message
                return message["result"]
            self._note(message)

    def _note(self, message: dict[str, Any]) -> None:
        match message.get("method"):
            case "Network.requestWillBeSent":
                self.fetched.append(message["params"]["request"]["url"])
            case "Network.webSocketCreated":
                self.fetched.append(message["params"]["url"])
            case "Network.webSocketFrameReceived":
                frame = message["params"]["response"]
                data = frame["payloadData"]
                self.frames.append(data if frame["opcode"] == 1 else base64.b64decode(data).decode(errors="replace"))

    async def open(self, url: str) -> None:
        await self.call("Page.navigate", url=url)

    async def run(self, script: str) -> Any:
        """The value of an expression, awaited."""
        answer = await self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    async def until(self, script: str) -> None:
        """Wait until the expression is true."""
        async with asyncio.timeout(PATIENCE):
            while not await self.run(script):
                await asyncio.sleep(0.1)

    async def until_drawn(self, text: str, *, since: int = 0) -> None:
        """Wait until the console has drawn it, in one piece, after that many frames."""
        try:
            async with asyncio.timeout(PATIENCE):
                while not any(text in frame for frame in self.frames[since:]):
                    await asyncio.sleep(0.1)
                    await self.run("1")
        except TimeoutError:
            raise AssertionError(f"{text!r} was not drawn; {self.fetched}; {''.join(self.frames)[-3000:]}") from None

    async def press(self, key: str, modifiers: int = 0) -> None:
        """As from a keyboard."""
        word = {"key": key, "code": key if len(key) > 1 else _code(key), "modifiers": modifiers}
        word |= {"windowsVirtualKeyCode": KEYS.get(key) or ord(key.upper())}
        letter = {"text": key} if len(key) == 1 and not modifiers else {}
        await self.call("Input.dispatchKeyEvent", type="keyDown", **word, **letter)
        await self.call("Input.dispatchKeyEvent", type="keyUp", **word)

    async def picture(self, path: Path) -> None:
        data = await self.call("Page.captureScreenshot", format="png")
        path.write_bytes(base64.b64decode(data["data"]))


def _code(key: str) -> str:
    return f"Digit{key}" if key.isdigit() else f"Key{key.upper()}"


class Browser:
    """One profile; its tabs share cookies."""

    def __init__(self, session: aiohttp.ClientSession, port: str) -> None:
        self._session, self._port = session, port

    async def tab(self) -> Page:
        async with self._session.put(f"http://127.0.0.1:{self._port}/json/new?about:blank") as answer:
            target = await answer.json(content_type=None)
        page = Page(await self._session.ws_connect(target["webSocketDebuggerUrl"], max_msg_size=2**26))
        for domain in ("Page", "Network", "Runtime"):
            await page.call(f"{domain}.enable")
        return page


@asynccontextmanager
async def chromium(profile: Path) -> AsyncIterator[Browser]:
    """A browser that is ended with the context, its helpers with it."""
    assert CHROMIUM is not None
    process = await asyncio.create_subprocess_exec(
        CHROMIUM,
        *FLAGS,
        f"--user-data-dir={profile}",
        "about:blank",
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        async with asyncio.timeout(PATIENCE), aiohttp.ClientSession() as session:
            while not (port := profile / "DevToolsActivePort").exists() or not port.read_text():
                await asyncio.sleep(0.1)
        async with aiohttp.ClientSession() as session:
            yield Browser(session, port.read_text().split()[0])
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        await process.wait()
