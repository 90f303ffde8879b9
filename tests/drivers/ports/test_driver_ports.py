"""The wires themselves: serial port, CAN bus, inbox, transcript."""

from __future__ import annotations

import os
import threading
import time

import pytest

from drivers.errors import LinkError
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from drivers.ports.inbox import BadRecords, Inbox
from drivers.ports.lines import LineCutter
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.ports.transcript import Chunk, Transcript, read_transcript
from tests.drivers.scripted_peer import Peer, wait_until


def quiet(peer, request):
    """Says nothing."""


def echo(peer, request):
    peer.send(request + b"\n")


def port_to(peer, **settings):
    return SerialPort("cell", SerialSettings(peer.port, 9600, **settings), LineCutter().feed)


def test_question_and_answer_leaves_other_records_alone():
    with Peer(lambda peer, request: peer.send(b"noise\n" + request + b"\n")) as peer:
        port = port_to(peer)
        port.open()
        assert port.ask(b"hello\n", lambda line: line == b"hello", 2.0) == b"hello"
        assert [line for _, line in port.inbox.take_all()] == [b"noise"]
        assert port.ask(b"x\n", lambda line: line == b"never", 0.05) is None
        port.close()


def test_arrival_is_stamped_and_in_order():
    with Peer(echo) as peer:
        port = port_to(peer)
        port.open()
        for _ in range(3):
            port.ask(b"a\n", lambda line: line == b"b", 0.01)
        wait_until(lambda: port.inbox.received == 3)
        stamps = [t for t, _ in port.inbox.take_all()]
        assert stamps == sorted(stamps)
        assert stamps[0] > 0
        port.close()


def test_a_port_is_exclusive():
    with Peer(quiet) as peer:
        first, second = port_to(peer), port_to(peer)
        first.open()
        with pytest.raises(LinkError, match="another program has it open"):
            second.open()
        with pytest.raises(LinkError, match="already open"):
            first.open()
        first.close()
        second.open()
        second.close()


def test_a_port_that_is_not_there():
    port = SerialPort("cell", SerialSettings("/dev/does_not_exist", 9600), LineCutter().feed)
    with pytest.raises(LinkError, match="cannot open /dev/does_not_exist"):
        port.open()
    with pytest.raises(LinkError, match="is not open"):
        port.write(b"x")
    port.close()


def test_a_port_by_url():
    port = SerialPort("cell", SerialSettings("loop://", 9600), LineCutter().feed)
    port.open()
    assert port.ask(b"to myself\n", lambda line: True, 2.0) == b"to myself"
    port.close()


def test_a_peer_that_takes_nothing_is_a_link_error():
    master, slave = os.openpty()
    port = SerialPort("cell", SerialSettings(os.ttyname(slave), 9600), LineCutter().feed)
    port.open()
    with pytest.raises(LinkError, match="refused"):
        port.write(b"x" * 100_000)
    assert not port.alive
    port.close()
    os.close(master)
    os.close(slave)


@pytest.fixture
def kept_waiting(monkeypatch):
    """This thread is run again 0.3 s after each of its writes."""
    ours, at_once = threading.get_ident(), os.write

    def late(descriptor, data):
        written = at_once(descriptor, data)
        if threading.get_ident() == ours:
            time.sleep(0.3)
        return written

    monkeypatch.setattr(os, "write", late)


def test_what_went_out_at_once_was_not_refused_because_this_process_had_to_wait(kept_waiting):
    with Peer(quiet) as peer:
        port = port_to(peer)
        port.open()
        port.write(b"hello\n")
        wait_until(lambda: peer.heard == [b"hello"])
        assert port.alive
        port.close()


def test_a_pulled_cable_wakes_who_waits():
    with Peer(lambda peer, request: threading.Thread(target=peer.unplug).start()) as peer:
        port = port_to(peer)
        port.open()
        with pytest.raises(LinkError, match="was lost"):
            port.ask(b"x\n", lambda line: True, 30.0)
        port.close()


def test_a_fault_of_the_parser_is_not_silent(capfd):
    def broken(data):
        raise KeyError("a mistake in a parser")

    with Peer(quiet) as peer:
        port = SerialPort("cell", SerialSettings(peer.port, 9600), broken)
        port.open()
        peer.send(b"x\n")
        wait_until(lambda: port.inbox.take_all() or not port.alive)
        assert "error of this program" in port.error
        assert port.inbox.wait_for(bool, 30.0) is None
        port.close()
    assert "a mistake in a parser" in capfd.readouterr().err


def test_transcript(tmp_path):
    path = tmp_path / "cell.txt"
    with Peer(echo) as peer:
        port = port_to(peer, capture=str(path))
        port.open()
        assert port.ask(b"abc\n", lambda line: True, 2.0) == b"abc"
        port.close()
    chunks = list(read_transcript(path))
    assert b"".join(c.data for c in chunks if c.direction == "<") == b"abc\n"
    assert b"".join(c.data for c in chunks if c.direction == ">") == b"abc\n"


def test_transcript_that_cannot_be_written(tmp_path):
    with Peer(quiet) as peer, pytest.raises(LinkError, match="cannot write the transcript"):
        port_to(peer, capture=str(tmp_path / "no folder" / "x")).open()


def test_transcript_on_a_full_disk_ends_but_the_port_goes_on():
    from pathlib import Path

    transcript = Transcript(Path("/dev/full"))
    transcript.write(1, "<", b"x")
    transcript.write(2, "<", b"x")
    assert "No space" in transcript.error
    transcript.close()


def test_a_transcript_that_is_none(tmp_path):
    path = tmp_path / "t"
    path.write_text("12 < 41 42\nhello\n")
    chunks = read_transcript(path)
    assert next(chunks) == Chunk(12, "<", b"AB")
    with pytest.raises(ValueError, match="line 2"):
        next(chunks)


def test_an_inbox_that_nobody_empties_drops_the_oldest_and_counts():
    inbox = Inbox(3)
    inbox.put([(1, 1), (1, 2)])
    inbox.put([(2, 3), (2, 4), (2, 5)])
    assert [r for _, r in inbox.take_all()] == [3, 4, 5]
    assert (inbox.received, inbox.dropped) == (5, 2)
    with pytest.raises(ValueError, match="at least 1"):
        Inbox(0)


def test_bad_records_keep_the_first_five():
    bad = BadRecords()
    for text in "abcdefg":
        bad.add(text)
    assert (bad.count, bad.first) == (7, tuple("abcde"))


def adapter(peer, request):
    peer.send(b"Z\r" if request.startswith((b"T", b"t")) else b"\r")


def everything(frame):
    return True


def test_two_devices_on_one_bus_get_their_own_frames(tmp_path):
    with Peer(adapter, terminator=b"\r") as peer:
        bus = CanBus("slcan", peer.port, 500_000, capture=str(tmp_path / "can.txt"))
        bus.open()
        bus.open()
        low, high = bus.subscribe(lambda f: f.id < 0x200), bus.subscribe(lambda f: f.id >= 0x200)
        peer.send(b"t12321122\rT000002AA1FF\r")
        wait_until(lambda: low.received + high.received == 2)
        assert [f for _, f in low.take_all()] == [Frame(0x123, False, b"\x11\x22")]
        assert [f for _, f in high.take_all()] == [Frame(0x2AA, True, b"\xff")]
        bus.send(Frame(0x123, False, b"\x01"))
        wait_until(lambda: peer.heard[-1:] == [b"t123101"])
        bus.close()
        bus.close()
    chunks = list(read_transcript(tmp_path / "can.txt"))
    assert [(c.direction, c.data) for c in chunks][-1] == (">", b"123#01")


def test_a_frame_that_went_out_at_once_was_not_refused_because_this_process_had_to_wait(kept_waiting):
    with Peer(adapter, terminator=b"\r") as peer:
        bus = CanBus("slcan", peer.port, 500_000)
        bus.open()
        bus.send(Frame(0x123, False, b"\x01"))
        wait_until(lambda: peer.heard[-1:] == [b"t123101"])
        assert bus.alive
        bus.close()


@pytest.mark.parametrize(
    "bad", [b"T00xx0917", b"T0000", b"t1232112", b"t123", b"r1230", b"T0000091788\xff0000000000000", b"\xff\xfe"]
)
def test_a_bad_line_is_counted_and_the_bus_goes_on(bad):
    with Peer(adapter, terminator=b"\r") as peer:
        bus = CanBus("slcan", peer.port, 500_000)
        bus.open()
        inbox = bus.subscribe(everything)
        peer.send(bad + b"\r")
        wait_until(lambda: bus.health().bad == 1)
        peer.send(b"t12321122\r")
        wait_until(lambda: inbox.received == 1)
        assert bus.health().alive
        assert len(bus.health().first_bad) == 1
        bus.close()


def test_a_can_port_is_exclusive():
    with Peer(adapter, terminator=b"\r") as peer:
        first, second = CanBus("slcan", peer.port, 500_000), CanBus("slcan", peer.port, 500_000)
        first.open()
        try:
            wait_until(lambda: peer.heard.count(b"O") == 2)  # python-can opens twice
            heard = len(peer.heard)
            with pytest.raises(LinkError, match="another program has it open"):
                second.open()
            assert len(peer.heard) == heard
        finally:
            first.close()


@pytest.mark.parametrize(
    "bus", [("slcan", "/dev/none", 500_000), ("slcan", "/dev/none", 123), ("socketcan", "none0", 500_000)]
)
def test_a_bus_that_does_not_open(bus):
    with pytest.raises(LinkError, match="does not open"):
        CanBus(*bus).open()


@pytest.mark.parametrize("bus", [("", "x", 1), ("slcan", "", 1), ("slcan", "x", 0), ("nothing", "x", 1)])
def test_impossible_buses(bus):
    with pytest.raises(ValueError, match=r"CAN|python-can has no interface"):
        CanBus(*bus)


def test_a_lost_bus_ends_every_inbox_and_close_still_lets_go():
    with Peer(adapter, terminator=b"\r") as peer:
        bus = CanBus("slcan", peer.port, 500_000)
        bus.open()
        inbox = bus.subscribe(everything)
        peer.unplug()
        assert inbox.wait_for(everything, 30.0) is None
        assert "was lost" in bus.error
        with pytest.raises(LinkError, match="was lost"):
            bus.send(Frame(1, False, b""))
        bus.close()


def test_an_adapter_that_takes_nothing_is_a_link_error():
    with Peer(adapter, terminator=b"\r") as peer:
        bus = CanBus("slcan", peer.port, 500_000)
        bus.open()
        wait_until(lambda: b"O" in peer.heard)
        peer._stop.set()
        peer._thread.join()
        with pytest.raises(LinkError, match=r"refused .* \(it took nothing more for 0\.2 s, .* left\): check adapter"):
            _send_for_ever(bus)
        assert not bus.alive
        bus.close()


def _send_for_ever(bus):
    while True:
        bus.send(Frame(0x123, False, bytes(8)))


def test_the_virtual_bus_of_python_can():
    one, two = CanBus("virtual", "desk", 500_000), CanBus("virtual", "desk", 500_000)
    one.open()
    two.open()
    inbox = two.subscribe(everything)
    one.send(Frame(0x1AB, True, b"\x05"))
    assert inbox.wait_for(everything, 2.0) == Frame(0x1AB, True, b"\x05")
    one.close()
    two.close()
