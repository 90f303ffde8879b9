"""Front ends connected to the controller: snapshots out, requests in, and the lease that says somebody attends."""

from __future__ import annotations

import socket
from collections import deque
from dataclasses import dataclass, field, replace
from pathlib import Path

from rig.errors import LinkError
from rig.link.front_end_messages import Request, Snapshot
from rig.link.sockets import Overrun, Peer, accept, remove

TRACE_ROWS = 12_000
"""10 minutes at 20 rows/s: what a console attached late is given."""
CLIENT_BOUND = 8 * 2**20
"""Bytes that may wait for a front end that does not read before it is dropped."""
MAX_CLIENTS = 8

TraceRow = tuple[float, float, float]


@dataclass
class Client:
    peer: Peer
    unsent: list[TraceRow]


@dataclass
class Clients:
    """The listening socket and everybody on it. Never blocks."""

    listener: socket.socket
    connected: list[Client] = field(default_factory=list)
    trace: deque[TraceRow] = field(default_factory=lambda: deque(maxlen=TRACE_ROWS))
    last_lease: float | None = None
    """s, when any front end last said that somebody attends, by a lease or by starting the campaign; from the first on
    an attended campaign needs one."""

    def poll(self, now: float) -> list[Request]:
        """Accept who waits, take all requests; leases are renewed here and not passed on."""
        self._accept()
        requests: list[Request] = []
        for client in list(self.connected):
            requests += self._take(client, now)
        return requests

    def lease_age(self, now: float) -> float:
        """Seconds since any front end said that somebody attends; 0 before the first ever did."""
        return 0.0 if self.last_lease is None else now - self.last_lease

    def add_trace(self, row: TraceRow) -> None:
        self.trace.append(row)
        for client in self.connected:
            client.unsent.append(row)

    def clear_trace(self) -> None:
        """A new run begins."""
        self.trace.clear()
        for client in self.connected:
            client.unsent.clear()

    def publish(self, snapshot: Snapshot) -> None:
        """Send to everybody; who does not read is dropped, and never holds the loop."""
        for client in list(self.connected):
            try:
                client.peer.send(replace(snapshot, trace=tuple(client.unsent), clients=len(self.connected)))
                client.unsent.clear()
            except (Overrun, LinkError):
                self._drop(client)

    def close(self) -> None:
        for client in list(self.connected):
            self._drop(client)
        path = self.listener.getsockname()
        self.listener.close()
        remove(Path(path))

    def _accept(self) -> None:
        while (peer := accept(self.listener, "front end", CLIENT_BOUND)) is not None:
            if len(self.connected) >= MAX_CLIENTS:
                peer.close()
                continue
            self.connected.append(Client(peer, list(self.trace)))

    def _take(self, client: Client, now: float) -> list[Request]:
        try:
            messages = client.peer.receive()
            client.peer.flush()
        except LinkError:
            self._drop(client)
            return []
        requests: list[Request] = []
        for message in messages:
            if not isinstance(message, Request):
                self._drop(client)
                return requests
            if message.kind in ("lease", "start"):
                self.last_lease = now
            if message.kind != "lease":
                requests.append(message)
        if client.peer.closed:
            self._drop(client)
        return requests

    def _drop(self, client: Client) -> None:
        client.peer.close()
        self.connected.remove(client)
