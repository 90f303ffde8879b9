"""Ports over a wire that somebody else opened: its stamps, its time, and the same codecs."""

from collections import deque

import pytest

from drivers.errors import DeviceError, LinkError
from drivers.ports.can_bus import CanBus
from drivers.ports.can_frame import Frame
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.serial_lines.line_stream import LineStream, Options

OPTIONS = Options("nowhere", r"(?P<raw>-?\d+)", rate=80.0, line_characters=11, scale=0.5)


class Scripted:
    """A far end that says at given times what it was given to say, and keeps what it hears."""

    def __init__(self, *says: tuple[float, bytes]) -> None:
        self.t = 0.0
        self.says = deque(says)
        self.heard = b""
        self.arrived = None

    def now(self) -> float:
        return self.t

    def wait(self, seconds: float) -> None:
        self.t += seconds if not self.says else min(max(self.says[0][0] - self.t, 0.0), seconds)
        while self.says and self.says[0][0] <= self.t:
            at, data = self.says.popleft()
            if self.arrived is not None:
                self.arrived(round(at * 1e9), data)

    def connect(self, arrived) -> None:
        self.arrived = arrived

    def write(self, data: bytes) -> None:
        self.heard += data

    def disconnect(self) -> None:
        self.arrived = None


def test_a_driver_reads_a_wire_with_the_stamps_of_the_wire():
    wire = Scripted((0.5, b"  12\r\n"), (0.75, b"-4\r\n7"), (1.0, b"7\r\n"))
    device = LineStream("cell", OPTIONS, wire)
    device.open()
    assert wire.t == 0.5, "opening waits for the first line, in the time of the wire"
    wire.wait(0.25)
    wire.wait(0.25)
    assert [(s.t_ns, s.values[0]) for s in device.drain()] == [
        (500_000_000, 6.0),
        (750_000_000, -2.0),
        (1_000_000_000, 38.5),
    ]
    assert device.health().alive
    device.close()
    assert wire.arrived is None
    assert not device.health().alive


def test_nobody_answers_in_the_time_of_the_wire():
    wire = Scripted()
    with pytest.raises(DeviceError, match="within 3 s"):
        LineStream("cell", OPTIONS, wire).open()
    assert wire.t == pytest.approx(3.0)


def test_a_port_over_a_wire_is_opened_once_and_writes_only_while_open(tmp_path):
    settings = SerialSettings("nowhere", 9600, capture=str(tmp_path / "bytes"))
    wire = Scripted((0.25, b"ab"))
    port = SerialPort("cell", settings, lambda data: [data], wire)
    with pytest.raises(LinkError, match="not open"):
        port.write(b"x")
    port.open()
    with pytest.raises(LinkError, match="already open"):
        port.open()
    assert port.ask(b"?", lambda record: record == b"ab", 1.0) == b"ab"
    port.close()
    port.close()
    assert wire.heard == b"?"
    assert (tmp_path / "bytes").read_text() == "0 > 3f\n250000000 < 61 62\n"


def test_a_bus_speaks_slcan_over_a_wire(tmp_path):
    """Lines as LAWICEL's manual has them; half a line waits for its other half, a broken one is counted."""
    wire = Scripted((0.5, b"\r\rT000009174000000"), (0.75, b"10\rTxyz\rt1232AABB\r"))
    bus = CanBus("slcan", "nowhere", 500_000, str(tmp_path / "frames"), wire)
    inbox = bus.subscribe(lambda frame: True)
    bus.open()
    bus.open()
    assert wire.heard.endswith(b"C\rS6\r\rO\r")
    assert inbox.wait_for(lambda frame: frame.id == 0x123, 1.0, take=False) == Frame(0x123, False, b"\xaa\xbb")
    stamps = [t_ns for t_ns, _ in inbox.take_all()]
    assert stamps == [750_000_000, 750_000_000]
    bus.send(Frame(0x17, True, b"\x01"))
    assert wire.heard.endswith(b"T00000017101\r")
    assert (bus.health().bad, bus.health().received) == (1, 2)
    bus.close()
    assert not bus.alive
    assert "750000000 < 30 30 30 30 30 39 31 37" in (tmp_path / "frames").read_text()


def test_only_an_slcan_adapter_is_reached_over_a_wire():
    with pytest.raises(ValueError, match="only an slcan adapter"):
        CanBus("socketcan", "can0", 500_000, wire=Scripted())
