"""Requests and floods into the controller's socket: the loop is not held up, memory does not grow, others are heard."""

from __future__ import annotations

import os
import resource
import signal
import socket
import time
from pathlib import Path

import numpy as np

from rig.link.clients import Clients
from rig.link.framing import encode
from rig.link.front_end_messages import LogLine, Request, Snapshot
from rig.link.sockets import connect, listen

from .mutation import Tally, mutant

PERIOD = 0.02
MOST_GROWTH = 64
"""MiB: what may wait for eight front ends that never read."""
SEEDS = tuple(encode(Request(kind, "x" * 20)) for kind in ("note", "stop", "pause", "lease"))
SHOWN = Snapshot(
    1,
    "c",
    "hold",
    "T1",
    0.0,
    0.0,
    (),
    (),
    (),
    tuple(LogLine(0.0, "info", "x" * 80) for _ in range(100)),
    100,
    (),
    None,
    (),
)


def run(count: int, seed: int, folder: Path) -> list[Tally]:
    """Three enemies send `count` requests together; a front end of ours reads and renews its lease beside them."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "s.sock"
    clients = Clients(listen(path))
    enemies = [_enemy(path, count // 3, seed + i) for i in range(3)]
    front = connect(path, "the controller")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    tally = Tally("", folder)
    ticks, taken, heard = [], 0, 0
    try:
        while enemies and not front.closed:
            begun, used = time.monotonic(), time.thread_time()
            taken += len(clients.poll(begun))
            clients.publish(SHOWN)
            ticks.append(1e3 * (time.thread_time() - used))
            front.send(Request("lease"))
            heard += len(front.receive())
            enemies = [pid for pid in enemies if os.waitpid(pid, os.WNOHANG) == (0, 0)]
            time.sleep(max(PERIOD - (time.monotonic() - begun), 0.0))
    finally:
        for pid in enemies:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
        clients.close()
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    tally.outcomes = {"sent": count // 3 * 3, "passed on": taken, "ticks": len(ticks), "snapshots read": heard}
    tally.what = (
        f"sockets (a tick took {np.quantile(ticks, 0.99):.1f} ms of a processor at p99, {max(ticks):.1f} ms at worst; "
        f"memory +{grown:.0f} MiB)"
    )
    if front.closed:
        tally.fail(f"sockets-{seed}", "our own front end was dropped", b"")
    if grown > MOST_GROWTH:
        tally.fail(f"sockets-{seed}", f"memory grew by {grown:.0f} MiB", b"")
    front.close()
    return [tally]


def _enemy(path: Path, count: int, seed: int) -> int:
    """A process that sends mutants, floods of notes, notes of 10 MB and silent connections, and never reads."""
    child = os.fork()
    if child:
        return child
    rng = np.random.default_rng(seed)
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    loud = encode(Request("note", "x" * 10_000_000))
    sent = 0
    try:
        while sent < count:
            with socket.socket(socket.AF_UNIX) as link:
                link.settimeout(0.2)
                try:
                    link.connect(str(path))
                    for _ in range(min(int(rng.integers(1, 400)), count - sent)):
                        data = loud if rng.random() < 0.0005 else SEEDS[0]
                        link.sendall(mutant(rng, SEEDS) if rng.random() < 0.1 else data)
                        sent += 1
                except OSError:
                    sent += 1  # refused, or dropped for what it sent
    finally:
        os._exit(0)
