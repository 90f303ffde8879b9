"""The far end of a console's link while a recording plays: snapshots out in time, and of what is asked only a stop.

There is no controller, no device and no port behind it: nothing that is asked here reaches a motor.
"""

from __future__ import annotations

import contextlib
import select
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rig.errors import LinkError
from rig.link.front_end_messages import Request
from rig.link.sockets import Peer, pair
from rig.replay.recorded import Frames

PERIOD = 0.1
"""s between two snapshots, as a controller sends them."""
MOST_WAITING = 1_000_000
"""Bytes that a front end may leave unread before a snapshot waits for it."""


def play(frames: Frames, peer: Peer, speed: float, over: Callable[[], bool], clock: Callable[[], float]) -> None:
    """Until the front end has left, or `over()`. After the end, or a stop, it is shown the end."""
    begun, skipped = clock(), 0.0
    due = begun
    while not peer.closed and not over():
        t = frames.begin + (clock() - begun) * speed + skipped
        due += PERIOD
        with contextlib.suppress(LinkError):  # a front end that is stuck is found gone by its own end of file
            if peer.waiting < MOST_WAITING:
                peer.send(frames.snapshot(min(t, frames.end)))
            if any(request.kind == "stop" for request in _heard(peer, due, clock)):
                skipped += max(frames.end - t, 0.0)


def _heard(peer: Peer, due: float, clock: Callable[[], float]) -> list[Request]:
    """What is asked until the next snapshot is due."""
    asked: list[Request] = []
    while (left := due - clock()) > 0.0 and not peer.closed:
        if select.select([peer], [], [], left)[0]:
            asked += [message for message in peer.receive() if isinstance(message, Request)]
        peer.flush()
    return asked


@contextmanager
def playing(frames: Frames, speed: float) -> Iterator[Peer]:
    """The link of a front end, at whose other end the recording plays until the block is left."""
    ours, theirs = pair("the replay")
    far, ended = Peer(theirs, "the console"), threading.Event()
    thread = threading.Thread(target=play, args=(frames, far, speed, ended.is_set, time.monotonic), name="replay")
    thread.start()
    try:
        yield ours
    finally:
        ended.set()
        ours.close()
        thread.join()
        far.close()
