"""Flow meter: golden sentences, garbage, and scripted instruments on ptys."""

from __future__ import annotations

import math
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DeviceError
from drivers.serial_lines import nortek_nmea
from tests.drivers.collecting import FOLDER, collect, quiet
from tests.drivers.scripted_peer import Peer, wait_until

NORTEK = tomllib.loads((FOLDER / "nortek_nmea.toml").read_text())


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
