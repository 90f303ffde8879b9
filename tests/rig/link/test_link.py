"""The local link: what is sent arrives whole, what is no message is named, nothing blocks, a gone side is noticed."""

import os
import socket
import stat
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.errors import LinkError
from rig.link.framing import encode
from rig.link.front_end_messages import Check, Point, Request, Snapshot
from rig.link.recorder_messages import Ack, ChannelSpec, EventRow, Open, Rows, StreamSpec
from rig.link.sockets import MAX_PATH, Overrun, Peer, accept, connect, listen, pair, remove, socket_path


def two_peers(bound=2**20):
    ours, theirs = pair("left", bound)
    return ours, Peer(theirs, "right")


def snapshot(thrust=1.0):
    return Snapshot(
        seq=3,
        campaign="water",
        state="hold",
        thruster="T1",
        command=2.5,
        time=1.0,
        readings=(),
        checks=(Check("motor", "passed", "VESC 23"),),
        points=(Point(1, 5.0, thrust, float("inf"), 2.0, True),),
        log=(),
        log_count=0,
        trace=((0.0, 1.0, float("nan")),),
        progress=None,
        files=("a.h5",),
    )


def test_the_controllers_side_never_loads_hdf5():
    code = (
        "import sys, rig.link.sockets, rig.link.recorder_messages, rig.importing.one_file, rig.recording.recover;"
        "print('h5py' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


def test_messages_arrive_in_order_and_whole():
    left, right = two_peers()
    opened = Open(
        "r.h5", 5, (StreamSpec("s", "sim", (ChannelSpec("thrust", "thrust", "N"),)),), {"thruster": "T1", "x": 1.5}
    )
    for message in (Request("note", "fouled ü"), opened, EventRow(1.0, "info", "x"), Ack((1, 2), 0.5, 10)):
        left.send(message)
    assert right.receive() == [Request("note", "fouled ü"), opened, EventRow(1.0, "info", "x"), Ack((1, 2), 0.5, 10)]
    assert right.receive() == []
    assert not right.closed
    left.close(), right.close()


def test_numbers_that_json_has_not_survive():
    left, right = two_peers()
    left.send(snapshot(thrust=float("nan")))
    (got,) = right.receive()
    assert np.isnan(got.points[0].thrust)
    assert got.points[0].std_error == float("inf")
    assert np.isnan(got.trace[0][2])
    left.close(), right.close()


@given(st.integers(1, 200), st.integers(1, 9), st.integers(0, 2**16 - 1))
@settings(max_examples=30, deadline=None)
def test_rows_are_bit_equal(n, channels, stream):
    left, right = two_peers()
    rng = np.random.default_rng(n)
    t_ns, values = rng.integers(0, 2**60, n), rng.normal(size=(n, channels))
    values[0, 0] = np.nan
    left.send(Rows(stream, t_ns, values))
    (got,) = right.receive()
    assert got.stream == stream
    assert np.array_equal(got.t_ns, t_ns)
    assert got.values.tobytes() == values.tobytes()
    left.close(), right.close()


def test_rows_of_a_wrong_shape_are_misuse():
    left, right = two_peers()
    with pytest.raises(ValueError, match="rows of stream 0: 2 times"):
        left.send(Rows(0, np.array([1, 2]), np.array([1.0, 2.0])))
    left.close(), right.close()


def test_a_frame_cut_in_pieces_waits_for_its_rest():
    left, right = socket.socketpair()
    peer = Peer(right, "left")
    frame = encode(Request("stop"))
    left.send(frame[:3])
    assert peer.receive() == []
    left.send(frame[3:-1])
    assert peer.receive() == []
    left.send(frame[-1:] + frame[:4])
    assert peer.receive() == [Request("stop")]
    left.close()
    assert peer.receive() == []
    assert peer.closed
    assert peer.unfinished == 4
    peer.close()


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (struct.pack("<IB", 2, 99) + b"{}", "kind 99"),
        (struct.pack("<IB", 2**31, 2), "2147483648 bytes"),
        (struct.pack("<IB", 2, 2) + b"{}", "malformed Request came: b'{}'"),
        (struct.pack("<IB", 4, 2) + b"\xff{]x", "malformed Request"),
        (struct.pack("<IB", 3, 32) + b"abc", "Rows frame of 3 bytes"),
        (struct.pack("<IB", 14, 32) + struct.pack("<HI", 0, 3) + b"12345678", "3 rows in 8 bytes"),
        (b"GET / HTTP/1.1\r\n\r\n", "not a rig process"),
    ],
)
def test_what_is_no_message_is_named(data, says):
    left, right = socket.socketpair()
    peer = Peer(right, "left")
    left.send(data)
    with pytest.raises(LinkError, match=says):
        peer.receive()
    left.close(), peer.close()


def test_a_reader_that_sleeps_overruns_the_bound_and_loses_nothing():
    left, right = two_peers(bound=100_000)
    sent = 0
    while left.waiting < 99_000:
        left.send(Rows(0, np.array([sent]), np.ones((1, 100))))
        sent += 1
    with pytest.raises(Overrun, match="bound is 100000"):
        left.send(Rows(0, np.array([sent]), np.ones((1, 200))))
    assert left.waiting <= 100_000
    got = []
    while len(got) < sent:
        got += right.receive()
        left.flush()
    assert [int(rows.t_ns[0]) for rows in got] == list(range(sent))
    left.close(), right.close()


def test_a_side_that_is_gone_is_seen_after_all_it_sent():
    left, right = two_peers()
    left.send(Request("stop"))
    left.close()
    right.send(Request("lease"))  # falls into the void, and must not hide what is still to be read
    right.send(Request("lease"))
    assert right.receive() == [Request("stop")]
    assert right.closed
    right.send(Request("lease"))
    assert right.receive() == []
    right.close()


def test_front_ends_connect_to_a_listening_socket(tmp_path):
    path = socket_path(tmp_path, "rig.sock")
    listener = listen(path)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert accept(listener, "nobody") is None
    client = connect(path, "controller")
    server = accept(listener, "console")
    client.send(Request("start"))
    assert server.receive() == [Request("start")]
    with pytest.raises(LinkError, match="already listens"):
        listen(path)
    for each in (client, server, listener):
        each.close()
    with pytest.raises(LinkError, match="controller does not answer"):
        connect(path, "controller")
    listen(path).close()  # the name left by a dead process is replaced
    remove(path)
    remove(path)
    with pytest.raises(LinkError, match="No such file"):
        connect(path, "controller")


def test_a_file_in_the_way_is_not_removed(tmp_path):
    (tmp_path / "rig.sock").write_text("mine")
    with pytest.raises(LinkError, match="not a socket"):
        listen(tmp_path / "rig.sock")
    with pytest.raises(LinkError, match="cannot listen"):
        listen(tmp_path / "nowhere" / "rig.sock")


def test_a_long_path_falls_back_to_a_private_directory(tmp_path):
    deep = tmp_path / ("d" * 120)
    deep.mkdir()
    path = socket_path(deep, "rig.sock")
    assert len(os.fsencode(path)) <= MAX_PATH
    assert path == socket_path(deep, "rig.sock")
    assert path != socket_path(tmp_path / ("e" * 120), "rig.sock")
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    listen(path).close()
    remove(path)
    assert socket_path(Path("/tmp"), "a.sock") == Path("/tmp/a.sock")


def test_a_fallback_directory_open_to_others_is_refused(tmp_path):
    open_to_all = tmp_path / "open"
    open_to_all.mkdir()
    open_to_all.chmod(0o777)
    with pytest.raises(LinkError, match="mode 0700"):
        socket_path(tmp_path / ("d" * 120), "rig.sock", fallback=open_to_all)
