"""A recorder in a process of its own and what a controller says to it; kills at any instant, and what must be left."""

import contextlib
import select
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from rig.hdf5 import load, recover
from rig.link.recorder_messages import Ack, ChannelSpec, Close, Open, Ready, Rows, StreamSpec
from rig.link.sockets import pair

STREAMS = tuple(
    StreamSpec(name, "sim", (ChannelSpec("thrust", "thrust", "N"), ChannelSpec("raw", None, "1", integer=True)))
    for name in ("cell_a", "cell_b")
)
PATIENCE = 30.0
"""s until a test gives up waiting for a message."""


def start(fd, **options):
    return subprocess.Popen(
        [sys.executable, "-m", "rig.recording.recorder", "--fd", str(fd)],
        pass_fds=(fd,),
        stdin=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=True,
        **options,
    )


@contextlib.contextmanager
def recorder(**options):
    ours, theirs = pair("recorder")
    process = start(theirs.fileno(), **options)
    theirs.close()
    try:
        yield ours, process
    finally:
        ours.close()
        try:
            process.wait(PATIENCE)
        finally:
            process.kill()
            process.wait()
            process.stderr.close()


def until(peer, kind):
    """Messages up to the first of a kind."""
    got = []
    end = time.monotonic() + PATIENCE
    while not any(isinstance(message, kind) for message in got):
        assert time.monotonic() < end, f"no {kind} came; got {got[-3:]}"
        assert not peer.closed, f"the recorder ended; got {got[-3:]}"
        select.select([peer], [peer] if peer.waiting else [], [], 1.0)
        peer.flush()
        got += peer.receive()
    return got


def rows(stream, first, n):
    index = np.arange(first, first + n)
    return Rows(stream, index * 1_000_000, np.column_stack([index * 0.5, index]).astype(float))


def opened(peer, path, **more):
    peer.send(Open(str(path), 0, STREAMS, {"recording_id": path.stem, "thruster": "T1"}, **more))
    until(peer, Ready)


def kill_once(path: Path, rng: np.random.Generator, *, closing: bool) -> tuple[int, int]:
    """Write, be killed within a second, read what is left. Returns the rows that were said to be flushed."""
    with recorder() as (peer, process):
        opened(peer, path)
        deadline = time.monotonic() + rng.uniform(0.0, 1.0)
        acked, first = (0, 0), 0
        while time.monotonic() < deadline:
            for stream in (0, 1):
                peer.send(rows(stream, first, 20))
            first += 20
            select.select([peer], [], [], 0.002)
            acked = ([m.rows for m in peer.receive() if isinstance(m, Ack)] or [acked])[-1]
        if closing:
            peer.send(Close("completed"))
            select.select([peer], [], [], rng.uniform(0.0, 0.03))
        process.kill()
        process.wait()
        acked = ([m.rows for m in peer.receive() if isinstance(m, Ack)] or [acked])[-1]
    check_killed(path, acked, path.with_name(f"{path.stem}-copy.h5"))
    return acked


def check_killed(path, acked, copy):
    recording = load(path)
    for stream, flushed in zip(("cell_a", "cell_b"), acked, strict=True):
        thrust, raw = (channel for channel in recording.channels if channel.stream == stream)
        n = thrust.value.size
        assert n >= flushed
        assert np.array_equal(thrust.value, np.arange(n) * 0.5)  # no wrong sample, none twice
        assert np.array_equal(raw.value, np.arange(n))
        assert np.allclose(thrust.time, np.arange(n) * 1e-3)
    if recording.attributes["opened_as"] == "swmr":
        recover(path, copy)
        copied = load(copy)
        assert copied.attributes["opened_as"] == "plain"
        assert [c.value.size for c in copied.channels] == [c.value.size for c in recording.channels]
