"""Thermometer: golden frames, refusals, and scripted instruments on ptys."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DeviceError, LinkError
from drivers.modbus import keller
from tests.drivers.collecting import FOLDER, collect, quiet
from tests.drivers.scripted_peer import Peer, wait_until

KELLER = tomllib.loads((FOLDER / "keller.toml").read_text())


def crc(data):
    """Modbus over serial line 1.02, 6.2.2."""
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return data + value.to_bytes(2, "little")


TRANSMITTER = {0x0002: b"\x3f\x80\x00\x00", 0x0008: b"\x41\x92\x00\x00"}


def transmitter(peer, request):
    register = int.from_bytes(request[2:4], "big")
    if request[:2] == b"\x01\x03" and register in TRANSMITTER:
        peer.send(crc(b"\x01\x03\x04" + TRANSMITTER[register]))


def test_request_is_the_one_of_the_manual():
    (case,) = KELLER["request"]
    with Peer(transmitter, terminator=None) as peer:
        device = keller.Keller("thermometer", keller.Options(peer.port, rate=20.0, baud=115_200, timeout=0.5))
        device.open()
        device.close()
        assert bytes.fromhex(case["frame"]) in peer.heard
    assert case["register"] == keller.P1


@pytest.mark.parametrize("case", KELLER["float"], ids=lambda case: str(case["value"]))
def test_floats(case):
    assert keller.decode_float(case["registers"]) == case["value"]
    assert keller.encode_float(case["value"]) == case["registers"]


@given(st.floats(width=32, allow_nan=False))
def test_float_round_trip(value):
    assert keller.decode_float(keller.encode_float(value)) == value


def test_a_float_takes_two_registers():
    with pytest.raises(ValueError, match="2 registers"):
        keller.decode_float([1])


def test_thermometer():
    with Peer(transmitter, terminator=None) as peer:
        device = keller.Keller("thermometer", keller.Options(peer.port, rate=20.0, baud=115_200, timeout=0.5))
        assert "Modbus address 1" in device.open()
        assert collect(device, 2)[0].values == (18.25, 1e5)
        assert [c.name for c in device.streams[0].channels] == ["water_temperature", "pressure"]
        health = device.health()
        assert (health.alive, health.bad) == (True, 0)
        device.close()
        device.close()
        assert not device.health().alive


def test_timeouts_and_refusals_are_counted_and_polling_goes_on():
    answers = iter([b""] * 1 + [crc(b"\x01\x83\x02")])

    def script(peer, request):
        if len(peer.heard) in (4, 5):
            peer.send(next(answers))
        else:
            transmitter(peer, request)

    with Peer(script, terminator=None) as peer:
        device = keller.Keller("thermometer", keller.Options(peer.port, rate=20.0, baud=115_200, timeout=0.4))
        device.open()
        wait_until(lambda: device.drain() is not None and device.health().bad >= 2)
        first, second = device.health().first_bad[:2]
        assert (first, second) == ("no reply within 0.4 s", "exception 2 (no such register)")
        assert collect(device, 2)[-1].values == (18.25, 1e5), "temperature and pressure are paired as they were asked"
        assert device.health().alive
        device.close()


def test_no_thermometer():
    with Peer(quiet, terminator=None) as peer:
        device = keller.Keller("thermometer", keller.Options(peer.port, timeout=0.1))
        with pytest.raises(DeviceError, match="no Keller transmitter answers at address 1"):
            device.open()
    with pytest.raises(LinkError, match="cannot open"):
        keller.Keller("thermometer", keller.Options("/dev/none")).open()


def test_a_pulled_thermometer():
    with Peer(transmitter, terminator=None) as peer:
        device = keller.Keller("thermometer", keller.Options(peer.port, rate=20.0, baud=115_200, timeout=0.1))
        device.open()
        peer.unplug()
        wait_until(lambda: not device.health().alive)
        assert any(word in device.health().error for word in ("was lost", "refused"))
        device.close()


def test_every_byte_is_kept(tmp_path):
    capture = tmp_path / "bytes.txt"
    with Peer(transmitter, terminator=None) as peer:
        options = keller.Options(peer.port, rate=20.0, baud=115_200, timeout=0.5, capture=str(capture))
        device = keller.Keller("thermometer", options)
        device.open()
        collect(device, 1)
        device.close()
    (case,) = KELLER["request"]
    assert f"> {case['frame']}" in capture.read_text()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"rate": 50.0}, "at most 15/s"),
        ({"address": 0}, "address must be"),
        ({"timeout": 0.0}, "timeout must be"),
        ({"port": ""}, "empty"),
    ],
)
def test_impossible_thermometer_options(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        keller.Options(**{"port": "p", **options})
