"""A line takes its time, loses what nobody reads, and spoils what it is told to spoil."""

import os
from math import inf

import numpy as np
import pytest

from sim_devices.wires.ports import PtyPort
from sim_devices.wires.serial_line import Wire


def wire(baud=9600, seed=1):
    return Wire(baud, np.random.default_rng(seed))


def drain(line, t):
    out = []
    while data := line.ready(t):
        out.append(data)
        line.taken(len(data))
    return out


def test_eighteen_characters_take_nineteen_milliseconds_at_9600_baud():
    line = wire()
    line.put(b"S D   1234.567 N\r\n", 0.0)
    assert line.due == pytest.approx(18 * 10 / 9600)
    assert line.ready(0.018) == b""
    assert drain(line, 0.019) == [b"S D   1234.567 N\r\n"]


def test_messages_wait_for_each_other_and_for_the_turnaround():
    line = wire()
    line.put(b"x" * 96, 0.0)
    line.put(b"y" * 96, 0.0)
    assert drain(line, 0.101) == [b"x" * 96]
    line.put(b"z" * 96, 0.3, turnaround=0.1)
    assert drain(line, 0.21) == [b"y" * 96]
    assert drain(line, 0.49) == []
    assert drain(line, 0.51) == [b"z" * 96]
    assert line.due == inf


def test_a_line_asked_for_more_than_it_carries_loses_whole_messages():
    line = wire()
    for i in range(300):
        line.put(b"0123456789abcdef\r\n", i * 0.01)
    assert line.lost > 50


def test_what_nobody_reads_grows_old_and_is_dropped_whole():
    line = wire(None)
    line.put(b"old\r\n", 0.0)
    line.put(b"new\r\n", 1.0)
    assert drain(line, 1.1) == [b"new\r\n"]
    assert line.lost == 1


def test_a_message_half_taken_is_finished_first():
    line = wire(None)
    line.put(b"first\r\n", 0.0)
    line.ready(0.0)
    line.taken(3)
    line.put(b"second\r\n", 0.1)
    assert line.due == -inf
    assert drain(line, 5.0) == [b"st\r\n"]


def test_faults_spoil_their_share():
    line = wire(None)
    line.fault("dropped", 0.5)
    for i in range(200):
        line.put(b"abcd\r\n", i * 1e-4)
    assert 70 < len(drain(line, 0.02)) < 130
    line.clear()
    line.fault("duplicated", 1.0)
    line.put(b"abcd\r\n", 1.0)
    assert drain(line, 1.0) == [b"abcd\r\n"] * 2
    line.clear()
    line.fault("corrupted", 1.0)
    line.put(b"abcd\r\n", 2.0)
    (spoilt,) = drain(line, 2.0)
    assert sum(bin(a ^ b).count("1") for a, b in zip(spoilt, b"abcd\r\n", strict=True)) == 1
    line.clear()
    line.fault("merged", 1.0)
    line.put(b"abcd\r\n", 2.1)
    assert drain(line, 2.1) == [b"abcd"]
    line.clear()
    line.fault("shifted", 1.0)
    line.put(b"abcd\r\n", 2.2)
    assert len(drain(line, 2.2)[0]) == 5
    line.clear()
    line.fault("delayed", 0.2)
    line.put(b"abcd\r\n", 3.0)
    assert drain(line, 3.1) == []
    assert drain(line, 3.2) == [b"abcd\r\n"]
    with pytest.raises(ValueError, match="dropped, duplicated"):
        line.fault("tangled", 1.0)


def test_a_full_pty_takes_part_of_a_line_and_the_rest_later(tmp_path):
    port = PtyPort(tmp_path / "cell", wire(None))
    host = (tmp_path / "cell").open("rb", buffering=0)
    os.set_blocking(host.fileno(), False)
    try:
        sent = [f"{i:06d}\r\n".encode() for i in range(3000)]  # 24 kB into a 4 kB buffer
        got = b""
        for i, message in enumerate(sent):
            port.wire.put(message, i * 1e-6)
        t = 0.003
        data = b"begin"
        while port.due < inf or data:
            port.flush(t)
            data = host.read(4096)
            got += data or b""
            t += 0.006
        assert b"".join(sent).startswith(got[:100])
        assert [line + b"\n" for line in got.split(b"\n")[:-1]] == sent[: got.count(b"\n")]
        assert got.count(b"\n") + port.wire.lost == 3000
    finally:
        host.close()
        port.pull()
    assert not (tmp_path / "cell").is_symlink()


def test_a_pulled_cable_fails_the_host_and_comes_back_under_its_name(tmp_path):
    port = PtyPort(tmp_path / "cell", wire(None))
    with (tmp_path / "cell").open("r+b", buffering=0) as host:
        host.write(b"SI\r\n")
        assert port.read() == b"SI\r\n"
        port.pull()
        port.pull()
        assert (port.read(), port.due, port.plugged) == (b"", inf, False)
        with pytest.raises(OSError, match="Input/output error"):
            host.write(b"SI\r\n")
    port.plug()
    with (tmp_path / "cell").open("r+b", buffering=0) as host:
        port.wire.put(b"\xff\x00\r\n\x03", 0.0)
        port.flush(0.0)
        assert host.read(10) == b"\xff\x00\r\n\x03"  # raw: nothing is translated
    port.pull()
