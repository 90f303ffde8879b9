"""A process that computes beside the console and says lines of JSON. It ends with the console.

What it does is kept from the screen: the console's loop reads a line when one has come and waits for none.
"""

from __future__ import annotations

import asyncio
import json
import signal
import tempfile
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncGenerator, Sequence
from contextlib import suppress
from typing import IO, Any, Final

LONGEST_LINE: Final = 2**24
"""Bytes."""


class Child:
    """One command, run once."""

    def __init__(self, command: Sequence[str]) -> None:
        self._command = command
        self._process: Process | None = None
        self._interrupted = False

    async def said(self, given: str = "") -> AsyncGenerator[dict[str, Any], None]:
        """Each object that it says; at last a `fault` when it ends as it should not. `given`: a line for it to read.

        Whoever stops listening ends it. Its standard input stays open until then: a child that waits for its end has
        its console's as well, also one that was killed.
        """
        with tempfile.TemporaryFile() as errors:
            try:
                process = await self._start(errors)
            except OSError as error:
                yield {"fault": f"{self._command[0]} can't be started: {error.strerror}"}
                return
            try:
                async for message in _messages(process, given):
                    yield message
                if await process.wait():
                    yield {"fault": self._last_words(errors, process)}
            finally:
                await self.end()

    async def end(self) -> None:
        """It has ended when this returns."""
        if self._process is not None:
            with suppress(ProcessLookupError):  # it has ended
                self._process.kill()
            await self._process.wait()
            self._process = None

    def interrupt(self) -> None:
        """It is to end with what it has; the second time at once."""
        if self._process is not None:
            with suppress(ProcessLookupError):
                self._process.send_signal(signal.SIGKILL if self._interrupted else signal.SIGINT)
        self._interrupted = True

    async def _start(self, errors: IO[bytes]) -> Process:
        self._process = await asyncio.create_subprocess_exec(
            *self._command, stdin=PIPE, stdout=PIPE, stderr=errors, limit=LONGEST_LINE, start_new_session=True
        )
        return self._process

    def _last_words(self, errors: IO[bytes], process: Process) -> str:
        if self._interrupted:
            return "it was interrupted"
        errors.seek(0)
        said = errors.read().decode(errors="replace").strip().splitlines()
        return said[-1] if said else f"its process ended with status {process.returncode}"


async def _messages(process: Process, given: str) -> AsyncGenerator[dict[str, Any], None]:
    """What is no object in JSON is passed over."""
    assert process.stdin is not None
    assert process.stdout is not None
    if given:
        process.stdin.write(given.encode() + b"\n")
    while line := await process.stdout.readline():
        with suppress(ValueError):
            message = json.loads(line)
            if isinstance(message, dict):
                yield message
