"""Front ends connected to the controller: snapshots out, requests in, and the lease that says somebody attends."""

from __future__ import annotations

import socket
from collections import deque
from dataclasses import dataclass, field, replace
from pathlib import Path

from rig.errors import LinkError
from rig.link.front_end_messages import Request, Snapshot, TraceRow
from rig.link.sockets import Overrun, Peer, accept, remove

TRACE_ROWS = 1200
"""2 minutes at 10 rows/s: what a console attached late is given, and as much as its plot shows."""
TRACE_AT_ONCE = 60
"""Rows in one snapshot: two minutes of a large bench are a megabyte, which the loop shall not write in one tick."""
CLIENT_BOUND = 8 * 2**20
"""Bytes that may wait for a front end that does not read before it is dropped."""
MAX_CLIENTS = 8
LONGEST_REQUEST = 8192
"""Bytes: a note of 500 letters, each of them twelve in JSON, and to spare. Who sends more is dropped."""
READ_PER_TICK = 4096
"""Bytes taken from one front end by one `poll`; the rest waits in its own process."""
ACCEPTED_PER_TICK = 16
PASSED_PER_TICK = 10
"""Requests that one `poll` passes on, a stop before all others: no person asks for more in a period of the loop."""
FLOOD = 100
"""Messages of one front end in one second: a key that is held down repeats 30 times, leases are two. Above: dropped."""
SILENCE = 30.0
"""s after which a front end that says nothing is dropped: all of ours renew a lease twice a second."""
OVERDUE = 3.0
"""s of silence after which a front end gives way where there is no room for another: a lease lasts 2 s."""


@dataclass
class Client:
    """One front end that is connected: what it has yet to be sent, and how much it says."""

    peer: Peer
    unsent: list[TraceRow]
    heard: float
    """s, of the latest message; at first of its arrival."""
    since: float
    """s, where the second began in which `count` messages came."""
    count: int = 0
    attends: bool = True
    """False: it looks on. Of what it asks only a stop is passed on, until it sends a lease."""

    def floods(self, messages: int, now: float) -> bool:
        """Whether these are too many for the second in which they came."""
        if now - self.since >= 1.0:
            self.since, self.count = now, 0
        self.count += messages
        if messages:
            self.heard = now
        return self.count > FLOOD


@dataclass
class Clients:
    """The listening socket and everybody on it. Never blocks."""

    listener: socket.socket
    connected: list[Client] = field(default_factory=list)
    trace: deque[TraceRow] = field(default_factory=lambda: deque(maxlen=TRACE_ROWS))
    last_lease: float | None = None
    """s, when any front end last said that somebody attends, by a lease or by starting the campaign; from the first on
    an attended campaign needs one."""

    @property
    def attending(self) -> int:
        """How many of those connected do not merely look on."""
        return sum(client.attends for client in self.connected)

    def poll(self, now: float) -> list[Request]:
        """Accept who waits, take all requests; leases are renewed here and not passed on. Who floods, sends what is no
        request, or has been silent for long is dropped, alone."""
        self._accept(now)
        requests: list[Request] = []
        for client in list(self.connected):
            requests += self._take(client, now)
        return requests if len(requests) <= PASSED_PER_TICK else _most_urgent(requests)

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
                rows = tuple(client.unsent[:TRACE_AT_ONCE])
                client.peer.send(replace(snapshot, trace=rows, clients=self.attending))
                del client.unsent[:TRACE_AT_ONCE]
            except (Overrun, LinkError):
                self._drop(client)

    def close(self) -> None:
        for client in list(self.connected):
            self._drop(client)
        path = self.listener.getsockname()
        self.listener.close()
        remove(Path(path))

    def _accept(self, now: float) -> None:
        for _ in range(ACCEPTED_PER_TICK):
            peer = accept(self.listener, "front end", CLIENT_BOUND, LONGEST_REQUEST, READ_PER_TICK)
            if peer is None:
                return
            if self._has_room(now):
                self.connected.append(Client(peer, list(self.trace), heard=now, since=now))
            else:
                peer.close()

    def _has_room(self, now: float) -> bool:
        """Where there is none, whoever has been silent the longest makes some: `rig stop` must get through."""
        if len(self.connected) >= MAX_CLIENTS:
            silent = min(self.connected, key=lambda client: client.heard)
            if now - silent.heard > OVERDUE:
                self._drop(silent)
        return len(self.connected) < MAX_CLIENTS

    def _take(self, client: Client, now: float) -> list[Request]:
        try:
            messages = client.peer.receive()
            client.peer.flush()
        except LinkError:
            self._drop(client)
            return []
        requests: list[Request] = []
        floods = client.floods(len(messages), now)
        for message in messages:
            if not isinstance(message, Request):
                self._drop(client)
                return requests
            requests += self._heard(client, message, now)
        if client.peer.closed or floods or now - client.heard > SILENCE:
            self._drop(client)
        return requests

    def _heard(self, client: Client, message: Request, now: float) -> list[Request]:
        """What is to be passed on of it."""
        if message.kind in ("lease", "watch"):
            client.attends = message.kind == "lease"
        if message.kind in ("lease", "start") and client.attends:
            self.last_lease = now
        if message.kind in ("lease", "watch"):
            return []
        return [message] if client.attends or message.kind == "stop" else []

    def _drop(self, client: Client) -> None:
        client.peer.close()
        self.connected.remove(client)


def _most_urgent(requests: list[Request]) -> list[Request]:
    """One stop, then the first of the others."""
    stops = [request for request in requests if request.kind == "stop"]
    return [*stops[:1], *(request for request in requests if request.kind != "stop")][:PASSED_PER_TICK]
