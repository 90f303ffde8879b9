"""The simulated flow meter, transmitter and CAN adapters: literal bytes from their manuals."""

from datetime import UTC, datetime
from math import inf, nan

import pytest

from sim_devices.instruments.modbus.keller import Keller, KellerOptions
from sim_devices.instruments.serial_lines.nortek import Nortek, NortekOptions, pnorc1, pnorc3, sentence
from sim_devices.tables import WorldError
from sim_devices.wires.can_frame import CanFrame
from sim_devices.wires.modbus_frames import crc16, framed
from sim_devices.wires.slcan import Adapter


def test_the_manuals_velocity_sentences():
    # DF=101 as in the tests of pynmea2 (a recording of 16 November 2009)
    when = datetime(2009, 11, 16, 13, 24, 55, tzinfo=UTC)
    body = sentence("PNORC1,161109,132455,3,11.0,0.332,0.332,0.332,0.332,78.9,78.9,78.9,78.9,78,78,78,78")
    assert body.endswith(b"*56\r\n")
    ours = pnorc1(when, (0.332,) * 4, 78.9, 78)
    assert ours.startswith(b"$PNORC1,111609,132455,1,0.5,0.332,0.332,0.332,0.332,78.9,78.9,78.9,78.9,78,78,78,78*")
    # DF=103, example of the Signature integrator's guide
    assert pnorc3(3.519, 110.9, 28.0, 6, position=4.5) == b"$PNORC3,CP=4.5,SP=3.519,DIR=110.9,AC=6,AA=28*3B\r\n"


class Meter:
    def __init__(self, speed, *sentences):
        self.speed = speed
        options = NortekOptions("nortek", "flow", sentences=sentences or ("PNORC1",))
        self.device = Nortek(options, lambda: self.speed, lambda: 0.0, datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC))


def test_the_flow_meter_talks_four_times_a_second_with_a_sign():
    meter = Meter(-0.25)
    assert meter.device.tick(0.0).startswith(b"$PNORC1,010226,030405,1,0.5,-0.250,0.000,0.000,0.000,68.0")
    assert meter.device.tick(0.99).count(b"$PNORC1") == 3
    assert meter.device.feed(b"anything", 1.0) == b""


def test_speed_and_direction_on_request():
    assert b"SP=0.250,DIR=180.0" in Meter(-0.25, "PNORC3").device.tick(0.0)
    assert b"SP=0.250,DIR=0.0" in Meter(0.25, "PNORC3").device.tick(0.0)


def test_faults_of_the_flow_meter():
    meter = Meter(0.5)
    meter.device.tick(0.0)
    meter.device.fault("frozen", 0.0)
    meter.speed = 0.7
    assert b",0.500," in meter.device.tick(0.25)
    meter.device.fault("no_echo", 0.3)
    assert b",-9.000,-9.000," in meter.device.tick(0.5)
    meter.device.fault("silent", 0.6)
    assert (meter.device.due, meter.device.tick(10.0)) == (inf, b"")
    meter.device.clear(20.0)
    assert meter.device.tick(20.3).count(b",0.700,") == 2
    meter.speed = nan
    assert b",-9.000," in meter.device.tick(20.5)
    with pytest.raises(ValueError, match="no_echo"):
        meter.device.fault("tired", 0.0)


def test_a_rate_the_line_cannot_carry_is_refused():
    with pytest.raises(WorldError, match="do not fit 9600 baud"):
        NortekOptions("nortek", "flow", rate=16.0)
    with pytest.raises(ValueError, match="PNORC1"):
        NortekOptions("nortek", "flow", sentences=("PNORS1",))


def transmitter(**options):
    return Keller(KellerOptions("keller", "thermometer", **options), lambda: 1.0e5, lambda: 25.0)


READ_P1 = bytes.fromhex("010300020002") + bytes.fromhex("65cb")
"""Golden request: function 3, P1."""


def test_the_checksum_of_known_frames():
    for frame in ("010300060008a40d", "010600050008980d", "018302c0f1", "01030002000265cb"):
        assert crc16(bytes.fromhex(frame)) == 0


def test_pressure_and_temperature():
    assert transmitter().feed(READ_P1, 0.0) == framed(bytes.fromhex("0103043f800000"))  # 1 bar
    assert transmitter().feed(framed(bytes.fromhex("010300080002")), 0.0) == framed(bytes.fromhex("01030441c80000"))
    mirrored = transmitter().feed(framed(bytes.fromhex("010301080002")), 0.0)
    assert mirrored == framed(bytes.fromhex("01030441c80000"))


@pytest.mark.parametrize(
    ("request_", "reply"),
    [
        ("010400020002", "018401"),  # function 4 is not there
        ("0103000b0002", "018302"),  # beyond the block
        ("010300020000", "018303"),  # no registers
        ("010800001234", "010800001234"),  # echo
    ],
)
def test_exceptions_and_echo(request_, reply):
    assert transmitter().feed(framed(bytes.fromhex(request_)), 0.0) == framed(bytes.fromhex(reply))


def test_what_is_not_answered():
    assert transmitter().feed(framed(bytes.fromhex("020300020002")), 0.0) == b""
    assert transmitter().feed(READ_P1[:-1] + b"\0", 0.0) == b""


def test_a_request_in_pieces_and_one_that_was_never_finished():
    device = transmitter()
    assert device.feed(READ_P1[:3], 0.0) == b""
    assert device.feed(READ_P1[3:], 0.01) != b""
    device.feed(READ_P1[:3], 1.0)
    assert device.feed(READ_P1, 2.0) != b""


def test_faults_of_the_transmitter():
    device = transmitter()
    device.fault("bad_crc", 0.0)
    assert crc16(device.feed(READ_P1, 0.0)) != 0
    device.fault("device_failure", 0.0)
    assert device.feed(READ_P1, 1.0) == framed(bytes.fromhex("018304"))
    device.fault("silent", 0.0)
    assert device.feed(READ_P1, 2.0) == b""
    device.fault("frozen", 0.0)
    assert device.feed(READ_P1, 3.0) == framed(bytes.fromhex("0103043f800000"))
    device.clear(3.0)
    assert (device.tick(4.0), device.due) == (b"", inf)
    with pytest.raises(ValueError, match="bad_crc"):
        device.fault("tired", 0.0)
    with pytest.raises(ValueError, match=r"1\.\.247"):
        KellerOptions("keller", "thermometer", address=0)


FRAME = CanFrame(0x17, bytes.fromhex("000061a8"))
LINE = b"T000000174000061A8\r"


def test_an_adapter_that_is_closed_refuses_frames():
    adapter = Adapter()
    assert adapter.feed(LINE) == (b"\a", [])
    assert adapter.deliver(FRAME) == b""


def test_an_adapter_that_is_open():
    adapter = Adapter()
    assert adapter.feed(b"C\rS6\rV\rN\rF\rO\r") == (b"\r\rV1013\rNSIM1\r\a\r", [])
    assert adapter.feed(LINE[:5]) == (b"", [])
    assert adapter.feed(LINE[5:]) == (b"Z\r", [FRAME])
    assert adapter.feed(b"t12320102\r") == (b"z\r", [CanFrame(0x123, b"\1\2", extended=False)])
    assert adapter.feed(b"r1234\r") == (b"z\r", [CanFrame(0x123, extended=False, remote=True, length=4)])
    assert adapter.deliver(FRAME) == LINE
    assert adapter.deliver(CanFrame(0x123, extended=False, remote=True, length=4)) == b"r1234\r"
    assert adapter.feed(b"S5\r") == (b"\a", [])
    assert adapter.feed(b"F\r\r") == (b"F00\r\r", [])
    assert adapter.feed(b"s031C\r") == (b"\a", [])


@pytest.mark.parametrize(
    "line", [b"T0000001740000\r", b"T2000001710\r", b"t123G\r", b"t1239\r", b"Q\r", b"S\r", b"x" * 65]
)
def test_what_an_adapter_refuses(line):
    adapter = Adapter()
    adapter.feed(b"O\r")
    assert adapter.feed(line) == (b"\a", [])


def test_listening_only():
    adapter = Adapter()
    adapter.feed(b"L\r")
    assert adapter.feed(LINE) == (b"\a", [])
    assert adapter.deliver(FRAME) == LINE
