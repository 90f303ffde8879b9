"""Line stream, flow meter and thermometer: golden frames, garbage, and scripted instruments on ptys."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers import KINDS, keller, line_stream, nortek_nmea
from drivers.errors import DeviceError, LinkError
from drivers.ports.can_bus import CanBus
from drivers.protocols import Instrument, MotorController
from tests.drivers.scripted_peer import Peer, wait_until

FOLDER = Path(__file__).parents[1] / "frames"
NORTEK = tomllib.loads((FOLDER / "nortek_nmea.toml").read_text())
KELLER = tomllib.loads((FOLDER / "keller.toml").read_text())


def quiet(peer, request):
    """Says nothing."""


def collect(device, count):
    samples = []
    wait_until(lambda: len(samples.extend(device.drain()) or samples) >= count)
    return samples


# --- line stream


def stream_options(port="/dev/null", pattern=r"(?P<raw>-?\d+)", **options):
    return line_stream.Options(port, pattern, **({"rate": 80.0, "line_characters": 9, "timeout": 0.3} | options))


def test_hx711_counts_are_kept_beside_the_force():
    with Peer(quiet) as peer:
        device = line_stream.LineStream("cell", stream_options(peer.port, scale=0.001, offset=-2.0))
        peer.send(b"Ready.\n-8388608\n1000\n")
        peer.streaming = b"12\n"
        assert "does not identify itself" in device.open()
        peer.streaming = None
        samples = collect(device, 1)
        (stream,) = device.streams
        assert [(c.name, c.integer, c.resolution) for c in stream.channels] == [
            ("thrust", False, 0.001),
            ("raw", True, None),
        ]
        assert samples[-1].values == (12 * 0.001 - 2.0, 12.0)
        with pytest.raises(DeviceError, match="tare by subtraction"):
            device.tare()
        device.close()
        device.close()


def test_value_unit_and_device_time():
    pattern = r"(?P<t>\d+);(?P<value>[-+.\d]+) (?P<unit>\w+)(?: raw=(?P<raw>\S+))?"
    script = {b"GO": b"17;-1.5 N raw=12\n18;2.5 N\n??\n19;... N\n20;1.0 N raw=x\n21;3.0 kg\n"}
    with Peer(lambda peer, request: peer.send(script.get(request, b""))) as peer:
        options = stream_options(peer.port, pattern, start="GO", stop="HALT", tare="ZERO", quantity=None, unit="N")
        device = line_stream.LineStream("cell", options)
        device.open()
        samples = []
        wait_until(lambda: samples.extend(device.drain()) or not device.health().alive)
        assert samples[0].values == (-1.5, 12.0, 17.0)
        assert samples[1].values[0] == 2.5
        assert math.isnan(samples[1].values[1])
        assert device.health().bad == 4
        assert "from N to kg" in device.health().error
        assert [c.name for c in device.streams[0].channels] == ["value", "raw", "device_time"]
        device.tare()
        device.close()
        wait_until(lambda: peer.heard == [b"GO", b"ZERO", b"HALT"])


def test_nothing_that_matches():
    with Peer(quiet) as peer:
        peer.streaming = b"hello\n"
        device = line_stream.LineStream("cell", stream_options(peer.port))
        with pytest.raises(DeviceError, match=r"came .'hello'"):
            device.open()


def test_a_lost_stream_closes_quietly():
    with Peer(quiet) as peer:
        peer.streaming = b"1\n"
        device = line_stream.LineStream("cell", stream_options(peer.port, stop="HALT"))
        device.open()
        peer.unplug()
        wait_until(lambda: not device.health().alive)
        device.close()


@given(st.integers(-(2**23), 2**23 - 1))
def test_counts_round_trip(counts):
    record = line_stream.Decoder(r"(?P<raw>-?\d+)").decode(b"%d" % counts)
    assert record == line_stream.Reading(pytest.approx(counts), counts, None, pytest.approx(math.nan, nan_ok=True))


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"pattern": "("}, "no regular expression"),
        ({"pattern": r"(\d+)"}, "needs a group"),
        ({"pattern": r"(?P<value>\d+)(?P<colour>.*)"}, "needs a group"),
        ({"scale": 0.0}, "scale must be finite"),
        ({"line_characters": 1}, "at least 2"),
        ({"rate": 1000.0, "baud": 9600}, "carries at most 107/s"),
    ],
)
def test_impossible_stream_options(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        stream_options(**options)


# --- flow meter


@pytest.mark.parametrize("case", NORTEK["velocity"], ids=lambda case: case["line"])
def test_velocity_sentences(case):
    assert nortek_nmea.decode(case["line"].encode()) == nortek_nmea.Velocity(case["cell"], tuple(case["components"]))


@pytest.mark.parametrize("case", NORTEK["other"], ids=lambda case: case["identifier"])
def test_sentences_of_the_manual_pass_the_checksum(case):
    assert nortek_nmea.decode(case["line"].encode()) == nortek_nmea.OtherSentence(case["identifier"])
    body = case["line"][1:].split("*")[0]
    assert nortek_nmea.encode(body) == case["line"].encode() + b"\r\n"


@given(st.integers(1, 20), st.tuples(*[st.integers(-8000, 8000)] * 3))
def test_velocity_round_trip(cell, thousandths):
    fields = ",".join(f"{v / 1000:.3f}" for v in thousandths)
    line = nortek_nmea.encode(f"PNORC1,083013,132455,{cell},0.5,{fields}").strip()
    assert nortek_nmea.decode(line) == nortek_nmea.Velocity(cell, tuple(v / 1000 for v in thousandths))


@pytest.mark.parametrize(
    "body",
    ["PNORC1,1,2,x,0.5,1,2,3", "PNORC1,1,2,1,0.5,1,2", *(f"PNORC1,1,2,1,0.5,{v}" for v in ("a,1,1", "1,a,1", "1,1,a"))],
)
def test_velocity_sentences_that_are_wrong(body):
    line = nortek_nmea.encode(body).strip()
    assert nortek_nmea.decode(line) == nortek_nmea.Unreadable(line)


@pytest.mark.parametrize("field", ["-9.000", "-999", "-9", "-9.99", ""])
def test_invalid_velocity_is_nan(field):
    record = nortek_nmea.decode(nortek_nmea.encode(f"PNORC1,1,2,1,0.5,{field},0.1,-9.1").strip())
    assert math.isnan(record.components[0])
    assert record.components[1:] == (0.1, -9.1)


@given(st.binary(max_size=200))
def test_garbage_before_a_sentence(garbage):
    line = nortek_nmea.encode("PNORC1,1,2,1,0.5,1.0,2.0,3.0")
    assert nortek_nmea.Decoder().feed(garbage + b"\n" + line)[-1] == nortek_nmea.Velocity(1, (1.0, 2.0, 3.0))


def test_flow_meter():
    lines = [nortek_nmea.encode(f"PNORC1,083013,132455,{cell},0.5,1.250,0.1,0.2") for cell in (1, 2)]
    with Peer(quiet) as peer:
        options = nortek_nmea.Options(peer.port, 4.0, cell=2, cells=2, sign=-1, timeout=1.0)
        device = nortek_nmea.NortekNmea("flow", options)
        peer.streaming = b"".join(lines) + lines[0].replace(b"1.250", b"1.350")
        device.open()
        assert collect(device, 3)[-1].values == (-1.25,)
        wait_until(lambda: device.drain() is not None and device.health().bad > 0)
        assert device.streams[0].channels[0].quantity == "flow_speed"
        assert device.health().alive
        device.close()
        device.close()


def test_no_flow_meter():
    with Peer(quiet) as peer:
        device = nortek_nmea.NortekNmea("flow", nortek_nmea.Options(peer.port, 10.0, timeout=0.2))
        with pytest.raises(DeviceError, match=r"no valid \$PNORC1"):
            device.open()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"rate": 20.0}, "at most 10/s"),
        ({"cell": 2}, "cell must be"),
        ({"component": 4}, "component must be"),
        ({"timeout": 0.1}, "shorter"),
    ],
)
def test_impossible_flow_options(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        nortek_nmea.Options(**{"port": "p", "rate": 4.0, **options})


# --- thermometer


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
        device = keller.Keller("thermometer", keller.Options(peer.port, rate=20.0, baud=115_200, timeout=0.1))
        device.open()
        wait_until(lambda: device.health().bad >= 2)
        seen = device.health().received
        wait_until(lambda: device.health().received > seen)
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
        assert "was lost" in device.health().error
        device.close()


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


# --- the list of kinds


def test_every_kind_is_an_instrument_and_only_the_motor_commands():
    options = {
        "mt_sics": {"port": "p", "rate": 10.0},
        "line_stream": {"port": "p", "pattern": r"(?P<value>\d+)", "rate": 10.0, "line_characters": 10},
        "nortek_nmea": {"port": "p", "rate": 4.0},
        "keller": {"port": "p"},
        "vesc_can": {"bus": "b", "vesc_id": 1, "pole_pairs": 7, "nominal_bus_voltage": 48.0, "watchdog_timeout": 0.5},
    }
    assert set(options) == set(KINDS)
    for name, kind in KINDS.items():
        bus = (CanBus("virtual", "x", 1),) if kind.link == "can" else ()
        device = kind.build(name, kind.options(**options[name]), *bus)
        assert isinstance(device, Instrument)
        assert isinstance(device, MotorController) == (name == "vesc_can")
        assert device.drain() == []
        assert not device.health().alive
        device.close()
