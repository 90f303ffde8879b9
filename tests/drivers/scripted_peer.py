"""The other end of the wire, scripted: a pty, a thread, and answers as plain bytes. Shares no code with the drivers."""

from __future__ import annotations

import contextlib
import os
import select
import threading
import tty
from collections.abc import Callable
from types import TracebackType

Script = Callable[["Peer", bytes], None]
"""Called with every complete request without its terminator, or (terminator None) with whatever came."""


class Peer:
    """A device on a pty. `port` is the path to open; `unplug` is the pulled cable."""

    def __init__(self, script: Script, terminator: bytes | None = b"\n") -> None:
        self._script, self._terminator = script, terminator
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self.heard: list[bytes] = []
        self.streaming: bytes | None = None
        """Sent again every millisecond while set."""
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="scripted peer")

    def __enter__(self) -> Peer:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.unplug()

    def send(self, data: bytes) -> None:
        with contextlib.suppress(OSError):
            os.write(self._master, data)

    def unplug(self) -> None:
        self._stop.set()
        self._thread.join()
        for descriptor in (self._master, self._slave):
            with contextlib.suppress(OSError):
                os.close(descriptor)

    def _run(self) -> None:
        rest = b""
        while not self._stop.is_set():
            if select.select([self._master], [], [], 0.001)[0]:
                data = rest + os.read(self._master, 4096)
                *requests, rest = (data, b"") if self._terminator is None else data.split(self._terminator)
                for request in requests:
                    request = request if self._terminator is None else request.strip()
                    self.heard.append(request)
                    self._script(self, request)
            if self.streaming is not None:
                self.send(self.streaming)


def answering(answers: dict[bytes, bytes]) -> Script:
    """Answers from a table; anything else gets `ES`, as an MT-SICS device says it."""

    def script(peer: Peer, request: bytes) -> None:
        peer.send(answers.get(request, b"ES\r\n"))

    return script


def wait_until(condition: Callable[[], bool], timeout: float = 5.0) -> None:
    """Returns as soon as the condition holds; fails the test when it never does."""
    pause = threading.Event()
    for _ in range(int(timeout / 0.005)):
        if condition():
            return
        pause.wait(0.005)
    raise AssertionError(f"did not happen within {timeout} s")
