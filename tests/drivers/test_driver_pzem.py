"""PZEM DC power meters: registers and what they mean, and the driver against a scripted slave."""

from __future__ import annotations

import tomllib

import pytest

from drivers.errors import DeviceError
from drivers.modbus.pzem import Options, Pzem, decode
from drivers.modbus.rtu import Read
from tests.drivers.collecting import FOLDER, collect, quiet
from tests.drivers.modbus_peer import Transmitter
from tests.drivers.scripted_peer import Peer, wait_until

FRAMES = tomllib.loads((FOLDER / "pzem.toml").read_text())
VALUES = dict(enumerate(FRAMES["reading"][0]["registers"]))


class Meter(Transmitter):
    """Input registers of values, holding registers of settings."""

    def __init__(self, shunt=0, values=VALUES):
        super().__init__(dict(values), function=4)
        self.settings = {0: 30000, 1: 700, 2: 1, 3: shunt}

    def answer(self, function, register, count):
        values, self.registers, self.function = (
            self.registers,
            self.settings if function == 3 else self.registers,
            function,
        )
        try:
            return super().answer(function, register, count)
        finally:
            self.registers = values


def options(port="p", **changed):
    return Options(port, **({"rate": 20.0, "timeout": 0.2} | changed))


@pytest.mark.parametrize("case", FRAMES["reading"], ids=lambda case: str(case["volts"]))
def test_golden_registers(case):
    assert Read(1, 4, 0, 8).encode() == bytes.fromhex(case["request"])
    volts, amps, watts, energy, high, low = decode(tuple(case["registers"]))
    assert (volts, amps, watts, energy) == pytest.approx(
        tuple(case[k] for k in ("volts", "amps", "watts", "watt_hours"))
    )
    assert high + 2 * low == case["alarm"]
    with pytest.raises(ValueError, match="8 registers"):
        decode((1, 2))


def test_rows():
    with Peer(Meter(), terminator=None) as peer:
        device = Pzem("meter", options(peer.port, shunt=100))
        assert device.open() == "Peacefair PZEM DC meter, Modbus address 1, shunt of 100 A (serial number not read)"
        rows = collect(device, 3)
        assert rows[0].values == pytest.approx((12.54, 5.23, 655.8, 17.0, 0.0))
        channels = {channel.name: channel for channel in device.streams[0].channels}
        assert (channels["current"].quantity, channels["bus_voltage"].quantity) == ("current", "bus_voltage")
        assert channels["current"].delay == pytest.approx(0.5 + 21 * 11 / 9600)
        assert device.health().alive
        assert device.health().bad == 0
        device.close()
        assert not device.health().alive


def test_a_meter_that_is_set_to_another_shunt_is_refused():
    with Peer(Meter(shunt=1), terminator=None) as peer:
        device = Pzem("meter", options(peer.port, shunt=100))
        with pytest.raises(DeviceError, match="set to a shunt of 50 A, the bench file says shunt = 100 A"):
            device.open()
        assert not device.health().alive
        device = Pzem("meter", options(peer.port))
        device.open()
        assert collect(device, 1)
        device.close()


def test_nobody_there():
    sentence = r"no PZEM DC meter answers at address 1 .*9600 8N2 .*no reply.*5 V"
    with Peer(quiet, terminator=None) as peer, pytest.raises(DeviceError, match=sentence):
        Pzem("meter", options(peer.port, timeout=0.05)).open()


def test_a_wrong_checksum_and_a_pulled_cable():
    meter = Meter()
    with Peer(meter, terminator=None) as peer:
        device = Pzem("meter", options(peer.port))
        device.open()
        meter.spoil = lambda reply: reply[:-1] + bytes((reply[-1] ^ 1,))
        wait_until(lambda: device.drain() is not None and device.health().bad >= 1)
        assert "checksum is wrong" in device.health().first_bad[0]
        meter.spoil = lambda reply: reply
        assert collect(device, 2)[-1].values[1] == pytest.approx(5.23)
        peer.unplug()
        wait_until(lambda: device.drain() is not None and not device.health().alive)
        device.close()


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"rate": 40.0}, "baud carries at most"),
        ({"address": 0}, "address must be 1 to 247"),
        ({"shunt": 75}, "shunt must be one of 100, 50, 200, 300 A"),
        ({"gain_std": 0.2}, "gain_std is relative"),
        ({"delay": -1.0}, "delay must be"),
        ({"timeout": 0.0}, "timeout must be"),
    ],
)
def test_impossible_options(changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        options(**changed)
