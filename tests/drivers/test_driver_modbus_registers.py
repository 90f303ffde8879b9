"""Registers of any Modbus device as channels: maps, requests, numbers, and the driver against a scripted device."""

from __future__ import annotations

import json
import math
import struct
import tomllib

import pytest

from drivers.errors import DeviceError
from drivers.modbus.register_map import Block, blocks, load_channels
from drivers.modbus.registers import ModbusRegisters, Options
from tests.drivers.collecting import FOLDER, collect, quiet
from tests.drivers.modbus_peer import Transmitter
from tests.drivers.scripted_peer import Peer, wait_until

METER = """
title = "Meter"
source = "made up for this test"
function = 4
[channels.bus_voltage]
register = 0
type = "u16"
scale = 0.01
unit = "V"
quantity = "bus_voltage"
[channels.input_current]
register = 1
type = "i16"
scale = 0.01
unit = "A"
[channels.input_power]
register = 2
type = "u32"
scale = 0.1
unit = "W"
[channels.water_temperature]
register = 40
type = "i16"
scale = 0.1
offset = -1.5
unit = "degC"
quantity = "water_temperature"
absent = [-32768, 32767]
[channels.emergency_stop]
register = 41
type = "u16"
bit = 3
invert = true
unit = "1"
quantity = "emergency_stop"
"""
REGISTERS = {0: 4823, 1: 0xFFF6, 2: 0x0001, 3: 0x86A0, 40: 197, 41: 0b1000} | dict.fromkeys(range(4, 40), 0)


@pytest.fixture
def meter(tmp_path):
    def written(text=METER):
        path = tmp_path / "meter.toml"
        path.write_text(text, encoding="utf-8")
        load_channels.cache_clear()
        return str(path)

    return written


def options(port, path, **changed):
    return Options(port, path, **{"rate": 50.0, "baud": 115200, "timeout": 0.1} | changed)


# -- maps ------------------------------------------------------------------------------------------------------------


def test_numbers(meter):
    channels = load_channels(meter()).channels
    assert channels["bus_voltage"].value([4823], "high_first") == pytest.approx(48.23)
    assert channels["input_current"].value([0xFFF6], "high_first") == pytest.approx(-0.1)
    assert channels["input_power"].value([1, 0x86A0], "high_first") == pytest.approx(10_000.0)
    assert channels["input_power"].value([0x86A0, 1], "low_first") == pytest.approx(10_000.0)
    assert channels["water_temperature"].value([197], "high_first") == pytest.approx(18.2)
    assert math.isnan(channels["water_temperature"].value([0x8000], "high_first"))
    assert channels["emergency_stop"].value([0b1000], "high_first") == 0.0
    assert channels["emergency_stop"].value([0b0111], "high_first") == 1.0


def test_a_float_that_is_none_is_no_value(meter):
    path = meter(METER.replace('type = "u32"\nscale = 0.1', 'type = "float32"'))
    channel = load_channels(path).channels["input_power"]
    for value in (math.nan, math.inf, -math.inf):
        assert math.isnan(channel.value(struct.unpack(">HH", struct.pack(">f", value)), "high_first"))
    assert channel.value(struct.unpack(">HH", struct.pack(">f", 2.5)), "high_first") == 2.5


def test_the_golden_reply_of_the_codec(meter):
    """Registers 6 to 13 as in tests/frames/modbus_rtu.toml."""
    frames = tomllib.loads((FOLDER / "modbus_rtu.toml").read_text())
    assert "01 03 10 08 80 00 00 30 39" in str(frames)
    path = meter(
        'title="T"\nsource="t"\nfunction=3\n[channels.status]\nregister=6\ntype="u16"\nunit="1"\n'
        '[channels.gross]\nregister=7\ntype="u32"\nunit="1"\n'
    )
    found = load_channels(path)
    (block,) = blocks(found, tuple(found.channels))
    assert block == Block(6, 3, ("status", "gross"))
    assert found.channels["gross"].value([0, 12345], "high_first") == 12345.0


def test_requests_are_as_few_as_the_device_allows(meter):
    every = tuple(load_channels(meter()).channels)
    assert [(b.register, b.registers) for b in blocks(load_channels(meter()), every)] == [(0, 42)]
    short = load_channels(meter(METER.replace("function = 4", "function = 4\nmost_registers = 8")))
    assert blocks(short, every) == (
        Block(0, 4, ("bus_voltage", "input_current", "input_power")),
        Block(40, 2, ("water_temperature", "emergency_stop")),
    )
    strict = load_channels(meter(METER.replace("function = 4", "function = 4\ngaps = false")))
    assert [(b.register, b.registers) for b in blocks(strict, every)] == [(0, 4), (40, 2)]
    assert blocks(strict, ("emergency_stop",)) == (Block(41, 1, ("emergency_stop",)),)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("function = 4", "function = 5", "function: Input should be 3 or 4, got 5"),
        ("register = 0", "register = -1", r"channels\.bus_voltage\.register: .* got -1"),
        ('type = "u32"', 'type = "bcd"', r"channels\.input_power\.type"),
        ("[channels.bus_voltage]", '[channels."bus voltage"]', "letters, digits and _ alone"),
        ("scale = 0.01", "scale = 0.0", "scale must be finite and not 0"),
        ('type = "u16"\nbit', 'type = "i16"\nbit', "only a u16 has a bit, not a i16"),
        ("bit = 3\n", "", "only a bit is inverted"),
        ("function = 4", "function = 4\nmost_registers = 1", "2 registers, more than the 1 of one request"),
        ("function = 4", "function = 4\nrate = 1", "rate: Unexpected keyword argument"),
        ("function = 4", "function", "is not TOML"),
    ],
)
def test_maps_that_are_none(meter, old, new, sentence):
    assert old in METER
    with pytest.raises(ValueError, match=rf"modbus_registers map .*meter\.toml.*{sentence}"):
        load_channels(meter(METER.replace(old, new)))


def test_a_map_without_channels_or_file(meter, tmp_path):
    with pytest.raises(ValueError, match=r"needs a table \[channels\.<name>\]"):
        load_channels(meter('title="T"\nsource="t"\nfunction=3\n[channels]\n'))
    with pytest.raises(ValueError, match=r"cannot be read \(No such file or directory\): check the path"):
        load_channels(str(tmp_path / "none.toml"))


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"channels": ("bus_volts",)}, "has bus_voltage, input_current.*, not 'bus_volts'"),
        ({"address": 0}, "Modbus address must be 1 to 247"),
        ({"word_order": "big"}, "word_order must be high_first or low_first"),
        ({"baud": 9600}, "9600 baud carries at most 9/s"),
        ({"timeout": 0.0}, "timeout must be between"),
        ({"delay": -1.0}, "delay must be between"),
    ],
)
def test_impossible_options(meter, changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        options("p", meter(), **changed)
    with pytest.raises(ValueError, match=r"must be the path of a \.toml file, not 'laumas'"):
        Options("p", "laumas", 1.0)


# -- the driver ------------------------------------------------------------------------------------------------------


def test_rows(meter):
    with Peer(Transmitter(dict(REGISTERS), function=4), terminator=None) as peer:
        device = ModbusRegisters("meter", options(peer.port, meter()))
        assert device.open() == "Meter, Modbus address 1 (serial number not read)"
        assert collect(device, 3)[-1].values == pytest.approx((48.23, -0.1, 10_000.0, 18.2, 0.0))
        (stream,) = device.streams
        assert [(c.name, c.quantity, c.unit, c.quantum) for c in stream.channels] == [
            ("bus_voltage", "bus_voltage", "V", 0.01),
            ("input_current", None, "A", 0.01),
            ("input_power", None, "W", 0.1),
            ("water_temperature", "water_temperature", "degC", 0.1),
            ("emergency_stop", "emergency_stop", "1", None),
        ]
        assert json.loads(stream.channels[3].calibration)["offset"] == -1.5
        assert (device.health().alive, device.health().bad) == (True, 0)
        device.close()
        assert not device.health().alive


def test_channels_that_need_two_requests_are_two_streams(meter):
    path = meter(METER.replace("function = 4", "function = 4\nmost_registers = 8"))
    with Peer(Transmitter(dict(REGISTERS), function=4), terminator=None) as peer:
        device = ModbusRegisters("meter", options(peer.port, path, channels=("emergency_stop", "bus_voltage")))
        device.open()
        rows = collect(device, 6)
        assert {row.stream: row.values for row in rows} == {"meter": (pytest.approx(48.23),), "meter_2": (0.0,)}
        assert [stream.name for stream in device.streams] == ["meter", "meter_2"]
        assert {row.stream for row in rows[:2]} == {"meter", "meter_2"}, "in turn"
        device.close()


def test_what_is_absent_is_nan(meter):
    script = Transmitter(dict(REGISTERS), function=4)
    with Peer(script, terminator=None) as peer:
        device = ModbusRegisters("meter", options(peer.port, meter(), channels=("water_temperature",)))
        device.open()
        script.registers[40] = 0x7FFF
        wait_until(lambda: any(math.isnan(row.values[0]) for row in device.drain()))
        assert device.health().alive
        device.close()


def test_a_register_that_is_not_there(meter):
    with Peer(Transmitter({0: 1}, function=4), terminator=None) as peer:
        device = ModbusRegisters("meter", options(peer.port, meter()))
        with pytest.raises(
            DeviceError, match=r"registers 0 to 41: exception 2 \(no such register\): check address.*meter\.toml"
        ):
            device.open()
        assert not device.health().alive


def test_nobody_answers(meter):
    with Peer(quiet, terminator=None) as peer:
        device = ModbusRegisters("meter", options(peer.port, meter(), timeout=0.03))
        with pytest.raises(DeviceError, match="no reply: check address, baud and framing"):
            device.open()


def test_spoilt_and_missing_replies_are_counted(meter):
    script = Transmitter(dict(REGISTERS), function=4)
    with Peer(script, terminator=None) as peer:
        device = ModbusRegisters("meter", options(peer.port, meter()))
        device.open()
        script.spoil = lambda reply: reply[:-1] + bytes((reply[-1] ^ 1,))
        wait_until(lambda: device.drain() is not None and device.health().bad >= 1)
        assert "checksum is wrong" in device.health().first_bad[0]
        script.spoil = lambda reply: reply
        assert collect(device, 2)
        peer.unplug()
        wait_until(lambda: device.drain() is not None and not device.health().alive)
        device.close()
        device.close()
