"""The simulated transmitter: literal bytes, its three makes, and everything that it can do wrong."""

from math import nan
from struct import pack, unpack

import pytest

from sim_devices.instruments.modbus.cell import ModbusCell
from sim_devices.instruments.modbus.registers import ModbusCellOptions
from sim_devices.tables import WorldError, build
from sim_devices.wires.modbus_frames import framed

G = 9.80665


class Bed:
    """A transmitter and the force on it, N."""

    def __init__(self, force=0.0, **options):
        self.force, self.t = force, 0.0
        self.device = ModbusCell(ModbusCellOptions("modbus_cell", "cell", **options), lambda: self.force)

    def run(self, seconds):
        self.t += seconds
        assert self.device.tick(self.t) == b""

    def ask(self, register, count, function=3, address=1):
        return self.device.feed(framed(pack(">BBHH", address, function, register, count)), self.t)

    def words(self, register, count, function=3):
        self.t += 0.1
        reply = self.ask(register, count, function)
        assert reply == framed(reply[:-2])
        assert reply[:3] == bytes((1, function, 2 * count)), reply.hex(" ")
        return unpack(f">{count}H", reply[3:-2])


def test_the_golden_reply():
    """12345 below zero and at rest, as a Laumas says it (status 0x0980: gross and net negative, stable)."""
    bed = Bed(-12.345 * G)
    bed.run(1.0)
    request = bytes.fromhex("01 03 00 06 00 08 a4 0d")
    assert bed.device.feed(request, bed.t) == framed(
        bytes.fromhex("01 03 10 09 80 00 00 30 39 00 00 30 39 00 00 00 00 00 00")
    )
    assert bed.ask(0, 33) == framed(bytes.fromhex("01 83 03")), "at most 32"
    assert bed.ask(0x200, 2) == framed(bytes.fromhex("01 83 02"))
    assert bed.ask(6, 1, function=4) == framed(bytes.fromhex("01 84 01"))
    assert bed.ask(6, 1, address=2) == b""


def test_a_laumas():
    bed = Bed(10.0 * G, decimals=1)
    bed.run(0.1)
    assert bed.words(6, 7) == (0, 0, 100, 0, 100, 0, 100)
    bed.force = 600.0
    bed.run(0.1)
    assert bed.words(6, 1)[0] & 0b100
    bed.force = nan
    bed.run(0.1)
    assert bed.words(6, 3) == (0b110 | 0x1000, 0, 0)


def test_a_dini_argeo():
    bed = Bed(-3.055 * G, map="dini_argeo_dgt")
    bed.run(1.0)
    assert bed.words(0, 5, function=4) == (0, 3055, 0, 3055, 0b111)
    assert bed.ask(0, 5) == framed(bytes.fromhex("01 83 01")), "input registers"
    bed.force = -501.0
    bed.run(0.01)
    assert bed.words(4, 1, function=4)[0] & 0b1000
    bed.force = 501.0
    bed.run(0.02)
    assert bed.words(4, 1, function=4)[0] & 0b10000


def test_a_seneca():
    bed = Bed(25.0, map="seneca_z_sg", unit="N")
    bed.run(1.0)
    assert bed.words(63, 2) == (0x41C8, 0)
    assert bed.words(2, 1) == (0x0500,)
    assert bed.words(77, 1) == (0b10000,)
    low = Bed(25.0, map="seneca_z_sg", unit="N", word_order="low_first")
    assert low.words(63, 2) == (0, 0x41C8)


def test_a_poll_gets_the_last_conversion():
    bed = Bed(0.0, rate=10.0, decimals=0, unit="N")
    bed.run(0.05)
    bed.force = 7.0
    assert bed.words(7, 2) == (0, 0)
    bed.run(0.0)
    assert bed.device.due == pytest.approx(0.2)
    assert bed.words(7, 2) == (0, 7)


FAULTS = [
    ("overload", 6, 0b100),
    ("underload", 6, 0b100),
    ("converter", 6, 0b10),
]


@pytest.mark.parametrize(("fault", "register", "bit"), FAULTS)
def test_what_the_status_says(fault, register, bit):
    bed = Bed(1.0)
    assert not bed.words(register, 1)[0] & bit
    bed.device.fault(fault, 0.0)
    assert bed.words(register, 1)[0] & bit
    bed.device.clear(0.0)
    assert not bed.words(register, 1)[0] & bit


def test_faults():
    bed = Bed(10.0 * G)
    bed.run(0.1)
    right = bed.words(7, 2)
    bed.device.fault("frozen", bed.t)
    bed.force = 0.0
    bed.run(1.0)
    assert bed.words(7, 2) == right
    bed.device.clear(bed.t)
    bed.force = 10.0 * G
    bed.run(0.1)
    for name, reply in (
        ("silent", b""), ("busy", framed(b"\x01\x83\x06")), ("device_failure", framed(b"\x01\x83\x04")),
        ("wrong_address", framed(b"\x02\x03\x04\x00\x00\x27\x10")),
        ("words_exchanged", framed(b"\x01\x03\x04\x27\x10\x00\x00")),
        ("wrong_unit", framed(b"\x01\x03\x04" + pack(">I", 98066))),
    ):  # fmt: skip
        bed.device.fault(name, bed.t)
        assert bed.ask(7, 2) == reply, name
    bed.device.fault("bad_crc", bed.t)
    reply = bed.ask(7, 2)
    assert reply != framed(reply[:-2])
    bed.device.fault("factor", bed.t, 2.0)
    bed.run(0.1)
    assert bed.words(7, 2) == (0, 20000)
    with pytest.raises(ValueError, match="expected one of frozen, silent"):
        bed.device.fault("tired", 0.0)
    with pytest.raises(ValueError, match="got 'converter'"):
        Bed(map="seneca_z_sg").device.fault("converter", 0.0)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"map": "loomas"}, "map must be one of laumas"),
        ({"unit": "lb"}, "unit must be one of N, g, kg"),
        ({"word_order": "middle"}, "high_first or low_first"),
        ({"address": 0}, r"1\.\.247"),
        ({"rate": 0.0}, "rate > 0"),
    ],
)
def test_what_a_world_file_may_not_say(options, sentence):
    with pytest.raises(WorldError, match=sentence):
        build(ModbusCellOptions, {"kind": "modbus_cell", "port": "p"} | options, "devices.cell")
