"""What an slcan adapter sends, as frames; python-can writes and reads the same lines and is the referee."""

import io

import can
import numpy as np
import pytest
from can.interfaces.slcan import slcanBus

from drivers.ports.can_frame import Frame
from drivers.ports.inbox import BadRecords
from drivers.ports.slcan_lines import LONGEST, REMEMBERED, SlcanLines


def frames(count: int, seed: int) -> list[Frame]:
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        extended = bool(rng.random() < 0.5)
        identifier = int(rng.integers(0, 2**29 if extended else 2**11))
        found.append(Frame(identifier, extended, rng.bytes(int(rng.integers(0, 9)))))
    return found


class Held:
    """A port that keeps what is written, and gives what it was given."""

    write_timeout = None

    def __init__(self, given: bytes = b"") -> None:
        self.written, self._given = b"", io.BytesIO(given)
        self._left = len(given)

    @property
    def in_waiting(self) -> int:
        return self._left - self._given.tell()

    def read(self, size: int) -> bytes:
        return self._given.read(size)

    def write(self, data: bytes) -> None:
        self.written += data

    def flush(self) -> None: ...

    def close(self) -> None: ...


def referee(port: Held) -> slcanBus:
    bus = slcanBus("loop://", sleep_after_open=0)
    bus.serialPortOrig.close()
    bus.serialPortOrig = port
    return bus


def read(*chunks: bytes) -> tuple[list[Frame], BadRecords]:
    bad = BadRecords()
    lines = SlcanLines(bad)
    return [frame for chunk in chunks for frame in lines.feed(chunk)], bad


def test_it_reads_what_python_can_writes():
    sent, port = frames(300, seed=1), Held()
    bus = referee(port)
    for frame in sent:
        bus.send(can.Message(arbitration_id=frame.id, is_extended_id=frame.extended, data=frame.data))
    found, bad = read(port.written)
    bus.shutdown()
    assert (found, bad.count) == (sent, 0)


def test_it_reads_as_python_can_reads():
    text = b"".join(
        (b"T%08X" if f.extended else b"t%03X") % f.id + b"%d" % len(f.data) + f.data.hex().encode() + b"\r"
        for f in frames(300, seed=2)
    )
    found, bad = read(text)
    bus = referee(Held(text))
    messages = [bus.recv(0.1) for _ in found]
    bus.shutdown()
    assert found == [Frame(m.arbitration_id, m.is_extended_id, bytes(m.data)) for m in messages]
    assert (len(found), bad.count) == (300, 0)


@pytest.mark.parametrize("size", [1, 2, 3, 7, 64])
def test_it_does_not_matter_how_the_bytes_are_cut(size):
    text = b"\rt12321122\rz\rT000009178FFFFE49C007BFF03\r\aZ\rt0010\rV1013\r"
    found, bad = read(*(text[i : i + size] for i in range(0, len(text), size)))
    assert found == [
        Frame(0x123, False, b"\x11\x22"),
        Frame(0x917, True, bytes.fromhex("ffffe49c007bff03")),
        Frame(1, False, b""),
    ]
    assert bad.count == 0


def test_the_stamp_of_an_adapter_is_no_data():
    assert read(b"t1232112205A7\r")[0] == [Frame(0x123, False, b"\x11\x22")]


@pytest.mark.parametrize(
    "line",
    [
        b"t12381122",  # cut off
        b"t1232112233",  # a byte too many
        b"t123911",  # no such length
        b"t8001FF",  # beyond 11 bits
        b"T200000001FF",  # beyond 29 bits
        b"T00xx09170",
        b"t 231 1",
        b"t12_1FF",
        b"r1230",  # asks for data, has none
        b"d12311FF",  # CAN FD
        b"hello",
        b"\xff\xfe",
        b"t12321122" * 2,  # two lines without the end between
    ],
)
def test_what_is_no_frame_is_counted_and_the_next_line_is_read(line):
    found, bad = read(line + b"\rt0011FF\r")
    assert found == [Frame(1, False, b"\xff")]
    assert bad.count == 1
    assert bad.first == (line.decode("ascii", "backslashreplace"),)


def test_what_never_ends_is_not_kept():
    bad = BadRecords()
    lines = SlcanLines(bad)
    for _ in range(1000):
        lines.feed(b"1" * 100)
    assert len(lines._rest) <= LONGEST
    assert bad.count == 1000
    assert lines.feed(b"\rt0011FF\r") == [Frame(1, False, b"\xff")]


def test_what_nobody_wants_is_counted_and_not_made():
    asked = []

    def wanted(identifier, extended):
        asked.append((identifier, extended))
        return (identifier, extended) == (0x123, True)

    lines = SlcanLines(BadRecords(), wanted)
    both = b"T0000012310A\rt12310B\r"
    assert lines.feed(both) == lines.feed(both) == [Frame(0x123, True, b"\x0a")]
    assert lines.sound == 4
    assert asked == [(0x123, True), (0x123, False)]
    lines.forget()
    lines.feed(both)
    assert asked == [(0x123, True), (0x123, False)] * 2


def test_not_every_identifier_is_remembered_for_ever():
    lines = SlcanLines(BadRecords(), lambda identifier, extended: False)
    for identifier in range(3 * REMEMBERED):
        lines.feed(b"T%08X0\r" % identifier)
    assert len(lines._remembered) <= REMEMBERED
    assert lines.sound == 3 * REMEMBERED
