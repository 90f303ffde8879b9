"""The simulated slave: literal bytes, every type of register, and all that it can do wrong."""

from math import nan
from struct import pack, unpack

import pytest

from sim_devices.instruments.modbus.registers_device import RegistersDevice, RegistersOptions
from sim_devices.wires.modbus_frames import framed

VALUES = (
    "0 u16 bus_voltage 0.01",
    "1 i16 input_current 0.01",
    "2 u32 pressure 1",
    "6 float32 water_temperature 1",
    "8 u16 contact 1",
)
WORLD = {"bus_voltage": 48.234, "input_current": -0.1, "pressure": 104_000.0, "water_temperature": 18.25}


class Bed:
    """A slave and the world it measures."""

    def __init__(self, **options):
        self.world = dict(WORLD)
        made = RegistersOptions("modbus_registers", "p", VALUES, **options)
        self.device = RegistersDevice(made, lambda channel: self.world[channel])

    def ask(self, register, count, function=3, address=1):
        return self.device.feed(framed(pack(">BBHH", address, function, register, count)), 0.0)

    def words(self, register, count):
        reply = self.ask(register, count)
        return unpack(f">{count}H", reply[3:-2])


def test_literal_bytes():
    bed = Bed()
    assert bed.device.feed(bytes.fromhex("01 03 00 00 00 02 c4 0b"), 0.0)[:-2].hex(" ") == "01 03 04 12 d7 ff f6"
    assert bed.device.tick(1.0) == b""


def test_registers():
    bed = Bed()
    assert bed.words(0, 9) == (4823, 0xFFF6, 0x0001, 0x9640, 0, 0, 0x4192, 0x0000, 1)
    assert Bed(word_order="low_first").words(2, 6) == (0x9640, 0x0001, 0, 0, 0x0000, 0x4192)
    bed.world |= {"bus_voltage": 1e9, "input_current": nan, "water_temperature": nan}
    assert bed.words(0, 2) == (0xFFFF, 0x8000)
    assert bed.words(6, 1)[0] & 0x7F80 == 0x7F80


def test_refusals():
    bed = Bed()
    assert bed.ask(0, 1, function=4) == framed(bytes.fromhex("01 84 01"))
    assert bed.ask(9, 1) == framed(bytes.fromhex("01 83 02"))
    assert bed.ask(0, 126) == framed(bytes.fromhex("01 83 03"))
    assert bed.ask(0, 1, address=2) == b""


def test_faults():
    bed = Bed()
    bed.words(0, 1)
    bed.device.fault("frozen", 0.0)
    bed.world["bus_voltage"] = 1.0
    assert bed.words(0, 1) == (4823,)
    bed.device.clear(0.0)
    assert bed.words(0, 1) == (100,)
    bed.device.fault("pressed", 0.0)
    assert bed.words(8, 1) == (0,)
    bed.device.fault("device_failure", 0.0)
    assert bed.ask(0, 1) == framed(bytes.fromhex("01 83 04"))
    bed.device.fault("bad_crc", 0.0)
    assert bed.ask(0, 1) != framed(bed.ask(0, 1)[:-2])
    bed.device.fault("silent", 0.0)
    assert bed.ask(0, 1) == b""
    with pytest.raises(ValueError, match="expected one of frozen"):
        bed.device.fault("pulled", 0.0)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ((), "at least one"),
        (("0 u16 bus_voltage",), "register type channel scale"),
        (("x u16 bus_voltage 1",), "register type channel scale"),
        (("0 u8 bus_voltage 1",), "register type channel scale"),
        (("0 u16 volts 1",), "'volts' is none of"),
    ],
)
def test_impossible_values(values, sentence):
    with pytest.raises(ValueError, match=sentence):
        RegistersOptions("modbus_registers", "p", values)
    with pytest.raises(ValueError, match="address"):
        RegistersOptions("modbus_registers", "p", VALUES, address=0)
