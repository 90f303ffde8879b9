"""The recorder process as the controller meets it: over its link, with a real process at the other end."""

import hashlib
import select
import signal
import socket
import time

import numpy as np
import pytest

from rig.hdf5 import load
from rig.link.recorder_messages import (
    Ack,
    Close,
    Closed,
    EventRow,
    Failed,
    Open,
    Ready,
    Rows,
    StepRow,
)
from rig.link.sockets import Peer
from tests.rig.recording.killed_recorder import PATIENCE, STREAMS, kill_once, opened, recorder, rows, start, until


def ended(peer):
    """Drain to the end of file: the recorder has ended."""
    end = time.monotonic() + PATIENCE
    got = []
    while not peer.closed:
        assert time.monotonic() < end
        select.select([peer], [], [], 1.0)
        got += peer.receive()
    return got


def test_two_files_one_after_another(tmp_path):
    with recorder() as (peer, process):
        for name in ("a", "b"):
            path = tmp_path / f"{name}.h5"
            opened(peer, path)
            for first in range(0, 1000, 100):
                peer.send(rows(0, first, 100))
            peer.send(rows(1, 0, 10))
            peer.send(StepRow(0, "hold", 2.0, 0.0, 1.0))
            peer.send(EventRow(0.5, "info", "tare 1 N"))
            ack = [message for message in until(peer, Ack) if isinstance(message, Ack)][-1]
            assert ack.rows == (1000, 10)
            assert ack.free_bytes > 0
            peer.send(Close("completed"))
            closed = until(peer, Closed)[-1]
            assert closed == Closed(str(path), hashlib.sha256(path.read_bytes()).hexdigest())
            recording = load(path)
            assert recording.complete
            assert recording.recording_id == name
            assert np.array_equal(recording.channels[0].value, np.arange(1000) * 0.5)
            assert recording.channels[0].time[-1] == pytest.approx(0.999)
            assert (len(recording.steps), len(recording.events)) == (1, 1)
        peer.close()
        assert process.wait(PATIENCE) == 0


def test_a_controller_that_dies_leaves_a_file_closed_in_order(tmp_path):
    path = tmp_path / "r.h5"
    with recorder() as (peer, process):
        opened(peer, path)
        for first in range(0, 5000, 100):
            peer.send(rows(0, first, 100))
        while peer.waiting:
            select.select([], [peer], [], 1.0)
            peer.flush()
        peer.close()
        assert process.wait(PATIENCE) == 0
    recording = load(path)
    assert recording.attributes["opened_as"] == "plain"
    assert recording.channels[0].value.size == 5000
    assert (recording.complete, recording.outcome) == (True, "aborted")
    assert recording.cause == "controller process ended without closing the recording"
    assert recording.events[-1].level == "error"


def test_a_message_cut_off_by_the_end_is_said(tmp_path):
    path = tmp_path / "r.h5"
    ours, theirs = socket.socketpair()
    process = start(theirs.fileno())
    theirs.close()
    peer = Peer(ours.dup(), "recorder")
    opened(peer, path)
    ours.setblocking(True)
    ours.sendall(b"\xff\x00\x00\x00\x20half a frame")
    ours.close(), peer.close()
    assert process.wait(PATIENCE) == 0
    process.stderr.close()
    assert "17 bytes of it came and are lost" in load(path).events[0].text


def test_signals_of_the_terminal_do_not_end_it(tmp_path):
    with recorder() as (peer, process):
        opened(peer, tmp_path / "r.h5")
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP) * 5:
            process.send_signal(number)
            peer.send(rows(0, 0, 1))
        until(peer, Ack)
        peer.send(Close("completed"))
        until(peer, Closed)


def test_a_file_that_cannot_be_made_fails_and_the_next_can(tmp_path):
    with recorder() as (peer, _):
        (tmp_path / "there.h5").write_text("mine")
        for path, more, says in (
            (tmp_path / "there.h5", {}, "cannot create"),
            (tmp_path / "no" / "r.h5", {}, "is not a folder"),
            (tmp_path / "huge.h5", {"expected_bytes": 2**60}, "MiB free; the plan needs"),
        ):
            peer.send(Open(str(path), 0, STREAMS, **more))
            assert says in until(peer, Failed)[-1].text
        assert (tmp_path / "there.h5").read_text() == "mine"
        opened(peer, tmp_path / "r.h5")
        peer.send(Close("completed"))
        until(peer, Closed)


@pytest.mark.parametrize(
    ("message", "says"),
    [
        (Ready("x"), "a Ready, which a recorder does not take"),
        (Rows(9, np.array([1]), np.array([[1.0, 2.0]])), "stream 9 of 2"),
        (Open("/x.h5", 0, STREAMS), "close that first"),
    ],
)
def test_orders_that_make_no_sense_close_the_file_and_end(tmp_path, message, says):
    path = tmp_path / "r.h5"
    with recorder() as (peer, process):
        opened(peer, path)
        peer.send(rows(0, 0, 5))
        peer.send(message)
        assert says in ended(peer)[-1].text
        assert process.wait(PATIENCE) == 3
    recording = load(path)
    assert recording.outcome == "aborted"
    assert says in recording.cause
    assert recording.channels[0].value.size == 5


def test_rows_without_a_file_end_it():
    with recorder() as (peer, process):
        peer.send(rows(0, 0, 1))
        assert "while no recording was open" in ended(peer)[-1].text
        assert process.wait(PATIENCE) == 3


def limit_file_size():
    import resource

    resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))


def test_a_full_disk_says_so_and_keeps_what_was_flushed(tmp_path):
    path = tmp_path / "r.h5"
    with recorder(preexec_fn=limit_file_size) as (peer, process):
        opened(peer, path)
        acks, got, first = [], [], 0
        end = time.monotonic() + PATIENCE
        while not peer.closed:
            assert time.monotonic() < end
            peer.send(rows(0, first, 500))
            first += 500
            select.select([peer], [], [], 0.1)
            got += peer.receive()
        acks = [message for message in got if isinstance(message, Ack)]
        assert isinstance(got[-1], Failed)
        assert process.wait(PATIENCE) == 3
    recording = load(path)
    value = recording.channels[0].value
    assert value.size >= acks[-1].rows[0] > 0
    assert np.array_equal(value, np.arange(value.size) * 0.5)


@pytest.mark.reliability
@pytest.mark.parametrize("part", range(4))
def test_kill_at_any_instant_leaves_every_flushed_row(tmp_path, part):
    """Promise 15: 24 kills at random instants, among them during writing, flushing and closing. Six at a time: each
    starts a process, and beside a busy machine 24 of these take longer than a test may."""
    rng = np.random.default_rng([20, part])
    for trial in range(6):
        kill_once(tmp_path / f"{trial}.h5", rng, closing=trial % 4 == 3)
