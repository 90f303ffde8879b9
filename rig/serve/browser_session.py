"""One browser's console: a process whose screen goes to a websocket and whose keys come from it."""

from __future__ import annotations

import asyncio
import contextlib
import json
import signal
from asyncio.subprocess import PIPE, Process
from collections.abc import Sequence
from typing import Final

from aiohttp import web
from textual_serve.app_service import AppService
from textual_serve.download_manager import DownloadManager

from rig.serve.messages import Keys, Resize, heard

DRIVER: Final = "rig.console.browser_driver:BrowserDriver"
LET_GO: Final = 3.0
"""s after SIGHUP in which a console lets go of the controller by itself (at most 2); then it is killed."""
READ: Final = 65536


class BrowserSession(AppService):
    """Textual's own carrier of screen and keys. A websocket that is gone is to its process what a closed terminal is to
    a console: SIGHUP, and at last SIGKILL. What a process may ask of a browser otherwise (open a page, take a file) is
    not passed on."""

    def __init__(self, command: Sequence[str], websocket: web.WebSocketResponse) -> None:
        """`command` starts the console's process."""
        AppService.__init__(
            self,
            " ".join(command),
            write_bytes=websocket.send_bytes,
            write_str=websocket.send_str,
            close=self._close,
            download_manager=DownloadManager(),
        )
        self._words = tuple(command)
        self._websocket = websocket
        self._left = False

    async def _close(self) -> None:
        await self._websocket.close()

    def _build_environment(self, width: int = 80, height: int = 24) -> dict[str, str]:
        return {**AppService._build_environment(self, width, height), "TEXTUAL_DRIVER": DRIVER}

    async def _open_app_process(self, width: int = 80, height: int = 24) -> Process:
        process = await asyncio.create_subprocess_exec(
            *self._words,
            stdin=PIPE,
            stdout=PIPE,
            stderr=PIPE,
            env=self._build_environment(width, height),
            start_new_session=True,  # Ctrl+C on the server's terminal is the server's
        )
        self._process, self._stdin = process, process.stdin
        return process

    async def hear(self, text: str) -> None:
        """One message of the browser; what is none of ours is ignored."""
        match heard(text):
            case Keys(data):
                await self.send_bytes(data)
            case Resize(width, height):
                await self.set_terminal_size(width, height)
            case None:
                pass

    async def on_meta(self, data: bytes) -> None:
        """The console's own word; only that it has left is of interest."""
        if json.loads(data).get("type") == "exit":
            self._left = True
            await self._close()

    async def on_packed(self, payload: bytes) -> None:
        """Pieces of files: the console gives none."""

    async def run(self) -> None:
        """Until the process has closed its output; the websocket is closed with it, however it ended."""
        assert self._process is not None
        assert self._process.stdout is not None
        try:
            await AppService.run(self)
        finally:
            await self._close()
        while await self._process.stdout.read(READ):
            pass  # a pipe that nobody reads would hold the process

    async def stop(self) -> None:
        """Returns once the process has ended. One that has left by itself may still fit and write; else it is ended."""
        process = self._process
        if process is None:
            return
        if not self._left:
            _signal(process, signal.SIGHUP)
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(process.wait(), LET_GO)
        try:
            if not self._left:
                _signal(process, signal.SIGKILL)
            if self._task is not None:
                await self._task
            await process.wait()
        finally:  # also where this is cancelled
            self._process = None


def _signal(process: Process, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError):
        process.send_signal(number)
