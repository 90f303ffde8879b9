"""MT-SICS: golden lines, round trips, garbage, and the driver against a scripted balance on a pty."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DeviceError, LinkError
from drivers.force_units import NEWTONS_PER_UNIT
from drivers.serial_lines.mt_sics import MtSics, Options
from drivers.serial_lines.mt_sics_lines import Decoder, Fault, Reply, Unreadable, Weight, decode, encode
from tests.drivers.scripted_peer import Peer, answering, wait_until

FRAMES = tomllib.loads((Path(__file__).parents[1] / "frames" / "mt_sics.toml").read_text())


@pytest.mark.parametrize("case", FRAMES["weight"], ids=lambda case: case["line"])
def test_weights(case):
    assert decode(case["line"].encode()) == Weight(case["value"], case["unit"], case["stable"])


@pytest.mark.parametrize("case", FRAMES["nothing"], ids=lambda case: case["line"])
def test_no_value_is_nan(case):
    weight = decode(case["line"].encode())
    assert isinstance(weight, Weight)
    assert math.isnan(weight.value)
    assert weight.unit == ""


@pytest.mark.parametrize("case", FRAMES["reply"], ids=lambda case: case["line"])
def test_replies(case):
    assert decode(case["line"].encode()) == Reply(case["command"], case["status"], case["text"])


@pytest.mark.parametrize("case", FRAMES["fault"], ids=lambda case: case["line"])
def test_faults(case):
    assert decode(case["line"].encode()) == Fault(case["code"])


@pytest.mark.parametrize("case", FRAMES["unreadable"], ids=lambda case: case["line"])
def test_unreadable(case):
    assert decode(case["line"].encode()) == Unreadable(case["line"].encode())


@given(st.integers(-9_999_999, 9_999_999), st.sampled_from(sorted(NEWTONS_PER_UNIT)), st.booleans())
def test_round_trip(thousandths, unit, stable):
    line = f"S {'S' if stable else 'D'} {thousandths / 1000:10.3f} {unit}".encode()
    assert decode(line) == Weight(thousandths / 1000, unit, stable)


@given(st.binary(max_size=200))
def test_garbage_is_never_an_exception_and_the_next_line_is_understood(garbage):
    assert Decoder().feed(garbage + b"\r\nS D      1.000 N\r\n")[-1] == Weight(1.0, "N", stable=False)


@given(st.lists(st.integers(1, 7), max_size=40))
def test_any_portions_give_the_same_records(cuts):
    data = b'S D     12.345 N\r\nS S     -0.001 N\r\nI4 A "B1"\r\n' * 3
    decoder, records, at = Decoder(), [], 0
    for cut in [*cuts, len(data)]:
        records += decoder.feed(data[at : at + cut])
        at += cut
    assert records == Decoder().feed(data)


def test_a_line_without_end_is_cut():
    decoder = Decoder()
    assert [type(r) for r in decoder.feed(b"x" * 5000)] == [Unreadable]
    assert decoder.feed(b"\nZ A\r\n") == [Reply("Z", "A", "")]


@pytest.mark.parametrize("command", ["", "sir", "S\r\n", "É"])
def test_encode_refuses_what_the_wire_cannot_carry(command):
    with pytest.raises(ValueError, match="MT-SICS command"):
        encode(command)


def test_encode():
    assert encode("UPD 92") == b"UPD 92\r\n"


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"rate": 200.0}, "asks 200 samples/s but 9600 baud carries at most 53/s"),
        ({"rate": -1.0}, "positive number of samples/s"),
        ({"baud": 0}, "baud must be positive"),
        ({"framing": "9N1"}, "framing must look like"),
        ({"sign": 2}, "sign must be 1 or -1"),
        ({"unit": "stone"}, "unit must be one of"),
        ({"gain_std": 0.5}, "gain_std is relative"),
        ({"timeout": 0.0}, "timeout must be"),
        ({"port": ""}, "port is empty"),
    ],
)
def test_impossible_options(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        Options(**{"port": "/dev/null", "rate": 10.0, **options})


def test_line_rate_depends_on_framing():
    Options(port="p", rate=52.0)
    with pytest.raises(ValueError, match="at most 48/s"):
        Options(port="p", rate=52.0, framing="8E1")


ANSWERS = {
    b"@": b'I4 A "B021"\r\n',
    b"I2": b'I2 A "WMS 404"\r\n',
    b"UPD 92": b"UPD A\r\n",
    b"UPD": b"UPD A 91.55\r\n",
    b"SIR": b"S D     10.000 N\r\nS D     11.000 N\r\n",
    b"TI": b"TI D      0.500 N\r\n",
}


def balance(**answers):
    return Peer(answering(ANSWERS | {key.replace("_", " ").encode(): value for key, value in answers.items()}))


def cell(peer, **options):
    defaults = {"port": peer.port, "rate": 92.0, "baud": 38_400, "timeout": 0.2}
    return MtSics("load_cell", Options(**(defaults | options)))


def collect(device, count):
    samples = []
    wait_until(lambda: len(samples.extend(device.drain()) or samples) >= count)
    return samples


def test_a_session_from_identification_to_close():
    with balance() as peer:
        device = cell(peer, sign=-1)
        assert device.open() == "WMS 404, serial number B021"
        assert [s.values for s in collect(device, 2)] == [(-10.0, 0.0), (-11.0, 0.0)]
        health = device.health()
        assert (health.alive, health.bad, health.error, health.dropped) == (True, 0, None, 0)
        device.tare()
        device.close()
        device.close()
        wait_until(lambda: peer.heard == [b"@", b"I2", b"UPD 92", b"UPD", b"SIR", b"TI", b"@"])
        assert not device.health().alive


def test_it_can_be_opened_again():
    with balance() as peer:
        device = cell(peer)
        for _ in range(2):
            device.open()
            assert len(collect(device, 2)) == 2
            device.close()


@pytest.mark.parametrize(("unit", "newtons"), [("N", 1.0), ("kg", 9.80665), ("g", 9.80665e-3), ("lb", 4.4482216152605)])
def test_units_become_newtons_with_standard_gravity(unit, newtons):
    with balance(SIR=f"S S      2.000 {unit}\r\n".encode()) as peer:
        device = cell(peer)
        device.open()
        (sample,) = collect(device, 1)
        device.close()
    assert sample.values == pytest.approx((2.0 * newtons, 1.0), rel=1e-12)


def test_overload_is_a_nan_row():
    with balance(SIR=b"S D     10.000 N\r\nS +\r\n") as peer:
        device = cell(peer)
        device.open()
        samples = collect(device, 2)
        device.close()
    assert math.isnan(samples[1].values[0])


def test_bad_lines_are_counted_and_the_first_five_kept():
    with balance(
        SIR=b"S D     10.000 N\r\n" + b"".join(b"?%d\r\n" % i for i in range(7)) + b"ES\r\nS S 1 N\r\n"
    ) as peer:
        device = cell(peer)
        device.open()
        assert len(collect(device, 2)) == 2
        health = device.health()
        device.close()
    assert health.bad == 8
    assert health.first_bad == ("?0", "?1", "?2", "?3", "?4")
    assert health.alive


def test_a_changed_unit_is_a_fault_and_no_sample():
    with balance(SIR=b"S D     10.000 N\r\nS D      1.020 kg\r\n") as peer:
        device = cell(peer)
        device.open()
        samples = []
        wait_until(lambda: samples.extend(device.drain()) or not device.health().alive)
        health = device.health()
        device.close()
    assert [s.values[0] for s in samples] == [10.0]
    assert health.bad == 1
    assert "changed its unit from N to kg" in health.error


def test_an_internal_error_is_a_fault_with_its_meaning():
    with balance(SIR=b"S D     10.000 N\r\nS S Error 10b\r\n") as peer:
        device = cell(peer)
        device.open()
        wait_until(lambda: device.drain() is not None and not device.health().alive)
        assert "EEPROM" in device.health().error
        device.close()


@pytest.mark.parametrize(
    ("answers", "options", "sentence"),
    [
        ({"@": b""}, {}, "no MT-SICS device answers"),
        ({"UPD_92": b"UPD L\r\n"}, {}, "does not accept 'UPD 92' .came 'UPD L'"),
        ({"UPD_92": b"ES\r\n"}, {}, "set set_rate = false"),
        ({"UPD": b"UPD A 10.0\r\n"}, {}, "says it sends 10.0"),
        ({"UPD": b"UPD A\r\n"}, {}, "says it sends nothing"),
        ({"SIR": b"S +\r\n"}, {}, "sends no weight after 'SIR'"),
        ({}, {"unit": "kg"}, "shows N, the bench file says kg"),
    ],
)
def test_a_device_that_is_not_right_is_refused_and_the_port_let_go(answers, options, sentence):
    with balance(**answers) as peer:
        device = cell(peer, **options)
        with pytest.raises(DeviceError, match=sentence):
            device.open()
        assert not device.health().alive


def test_fixed_rate_models_and_models_without_i2_or_readable_rate():
    with balance(I2=b"ES\r\n", UPD=b"ES\r\n") as peer:
        for set_rate in (True, False):
            device = cell(peer, set_rate=set_rate)
            assert device.open() == "unknown model, serial number B021"
            device.close()


def test_a_refused_tare():
    with balance(TI=b"TI +\r\n") as peer:
        device = cell(peer)
        device.open()
        with pytest.raises(DeviceError, match=r"came 'TI \+'"):
            device.tare()
        device.close()


def test_a_pulled_cable_while_streaming_and_while_taring():
    with balance() as peer:
        device = cell(peer)
        device.open()
        peer.unplug()
        wait_until(lambda: not device.health().alive)
        assert "was lost" in device.health().error
        with pytest.raises(LinkError, match="check adapter, cable"):
            device.tare()
        device.close()


def test_streams_are_known_before_opening():
    (stream,) = MtSics("cell", Options(port="/dev/null", rate=50.0, gain_std=0.0005)).streams
    assert (stream.name, stream.source, stream.period_s) == ("cell", "mt_sics", 0.02)
    assert [(c.name, c.quantity, c.unit) for c in stream.channels] == [("thrust", "thrust", "N"), ("stable", None, "1")]
    assert '"gain_std": 0.0005' in stream.channels[0].calibration
