"""The simulated PZEM by its bytes."""

import struct

import pytest

from sim_devices.instruments.modbus.pzem import Pzem, PzemOptions
from sim_devices.wires.modbus_frames import framed

VALUES = framed(bytes.fromhex("01 04 00 00 00 08"))


class Supply:
    volts, amps = 48.0, 5.234


def meter(**options):
    supply = Supply()
    return supply, Pzem(PzemOptions("pzem", "p", **options), lambda: supply.volts, lambda: supply.amps)


def words(reply):
    return struct.unpack(f">{reply[2] // 2}H", reply[3:-2])


def test_values_are_renewed_once_a_second():
    supply, device = meter()
    power = round(48.0 * 5.234 * 10)
    assert words(device.feed(VALUES, 0.1)) == (4800, 523, power, 0, 0, 0, 0, 0)
    supply.amps = 0.015
    device.tick(0.9)
    assert words(device.feed(VALUES, 0.9))[1] == 523
    device.tick(1.0)
    assert words(device.feed(VALUES, 1.0))[:3] == (4800, 0, 0), "it begins to measure at 0.02 A"
    supply.volts = 5.0
    device.tick(2.0)
    assert words(device.feed(VALUES, 2.0))[6:] == (0, 0xFFFF)


def test_settings_and_refusals():
    _, device = meter(shunt=50)
    assert words(device.feed(framed(bytes.fromhex("01 03 00 03 00 01")), 0.0)) == (1,)
    assert device.feed(framed(bytes.fromhex("01 04 00 05 00 08")), 0.1)[1:3] == b"\x84\x02"
    assert device.feed(framed(bytes.fromhex("01 10 00 05 00 08")), 0.2)[1:3] == b"\x90\x01"
    assert device.feed(framed(bytes.fromhex("02 04 00 00 00 08")), 0.3) == b""


def test_faults():
    supply, device = meter()
    device.fault("frozen", 0.0)
    supply.amps = 1.0
    device.tick(1.0)
    assert words(device.feed(VALUES, 1.0))[1] == 523
    device.fault("current_factor", 1.0, 2.0)
    device.tick(2.0)
    assert words(device.feed(VALUES, 2.0))[1] == 200
    device.fault("wrong_shunt", 2.0)
    assert words(device.feed(framed(bytes.fromhex("01 03 00 03 00 01")), 2.1)) == (1,)
    device.fault("device_failure", 2.2)
    assert device.feed(VALUES, 2.2)[1:3] == b"\x84\x04"
    device.clear(2.3)
    good = device.feed(VALUES, 2.3)
    device.fault("bad_crc", 2.4)
    assert device.feed(VALUES, 2.4)[:-1] == good[:-1]
    device.fault("silent", 2.5)
    assert device.feed(VALUES, 2.5) == b""
    with pytest.raises(ValueError, match="expected one of"):
        device.fault("tired", 0.0)
    with pytest.raises(ValueError, match="a shunt of"):
        PzemOptions("pzem", "p", shunt=75)
