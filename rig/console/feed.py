"""Where snapshots come from and requests go. The console knows this much of the controller, and no sockets."""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from typing import Protocol

from rig.errors import LinkError
from rig.link.front_end_messages import Request, Snapshot
from rig.link.sockets import Peer


class Feed(Protocol):
    """One controller, seen from a front end."""

    async def receive(self) -> Snapshot | None:
        """The next snapshot, in order; None for ever after: the controller is gone."""
        ...

    def send(self, request: Request) -> None:
        """Hand the request over before returning. Raises LinkError when it certainly goes nowhere."""
        ...

    def send_from_thread(self, request: Request) -> None:
        """The same from another thread than the event loop's. Raises LinkError, or says nothing: who must know sends
        once more from the loop."""
        ...

    def close(self) -> None:
        """Let the controller see the end of file. Safe to call twice."""
        ...


class SocketFeed:
    """A controller behind a local socket. Lives in one event loop, which it asks to watch the socket."""

    def __init__(self, peer: Peer) -> None:
        """Owns `peer` from here on."""
        self._peer = peer
        self._sending = threading.Lock()
        """Held while bytes are handed to the kernel, which never blocks."""
        self._snapshots: deque[Snapshot] = deque()
        self._news = asyncio.Event()
        self._watching = False
        self._loop: asyncio.AbstractEventLoop | None = None
        self._gone = False
        self._closed = False
        self.fault = ""
        """Why the link was given up, when it was not a plain end of file."""

    async def receive(self) -> Snapshot | None:
        self._watch()
        while not self._snapshots and not self._gone:
            self._news.clear()
            await self._news.wait()
        return self._snapshots.popleft() if self._snapshots else None

    def send(self, request: Request) -> None:
        if self._gone:
            raise LinkError(f"{self._peer.name} is gone: the request `{request.kind}` reaches nobody")
        with self._sending:
            self._peer.send(request)
        self._loop = asyncio.get_running_loop()
        self._send_on()

    def send_from_thread(self, request: Request) -> None:
        """What the kernel does not take now is left to the loop, once that has sent or received anything."""
        with self._sending:
            if self._gone:
                return
            self._peer.send(request)
            waiting = self._peer.waiting
        if waiting and self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._send_on)

    def close(self) -> None:
        if self._closed:
            return
        self._closed = True
        with self._sending:
            self._lose()
            self._peer.close()

    def _send_on(self) -> None:
        """The loop sends what waits, as soon as the kernel takes it."""
        if self._peer.waiting and not self._gone:
            asyncio.get_running_loop().add_writer(self._peer.fileno(), self._flush)

    def _watch(self) -> None:
        if not self._watching and not self._gone:
            self._watching = True
            self._loop = asyncio.get_running_loop()
            self._loop.add_reader(self._peer.fileno(), self._drain)

    def _drain(self) -> None:
        try:
            messages = self._peer.receive()
        except LinkError as error:
            self.fault = str(error)
            self._lose()
            return
        self._snapshots.extend(message for message in messages if isinstance(message, Snapshot))
        if self._peer.closed:
            self._lose()
        self._news.set()

    def _flush(self) -> None:
        with self._sending:
            self._peer.flush()
        if not self._peer.waiting:
            asyncio.get_running_loop().remove_writer(self._peer.fileno())

    def _lose(self) -> None:
        self._gone = True
        self._news.set()
        if self._watching:
            self._watching = False
            loop = asyncio.get_running_loop()
            loop.remove_reader(self._peer.fileno())
            loop.remove_writer(self._peer.fileno())
