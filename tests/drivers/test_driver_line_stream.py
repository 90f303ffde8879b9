"""Line stream: golden lines, garbage, and scripted instruments on ptys."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DeviceError
from drivers.serial_lines import line_stream
from tests.drivers.collecting import collect, quiet
from tests.drivers.scripted_peer import Peer, wait_until


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
        assert [(c.name, c.integer, c.quantum) for c in stream.channels] == [
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


def test_a_low_pass_whose_delay_is_not_told_is_refused():
    told = {"port": "p", "pattern": r"(?P<raw>-?\d+)", "rate": 80.0, "line_characters": 11}
    assert line_stream.Options(**told, delay=0.004, low_pass=0.003).low_pass == 0.003
    with pytest.raises(ValueError, match=r"low_pass must be between 0 and its delay \(0.001 s\).*add it to delay"):
        line_stream.Options(**told, delay=0.001, low_pass=0.003)


def test_a_contact_at_an_analogue_input_is_one_or_zero():
    """24 V is a closed contact, 0 V an open one; open is pressed."""
    with Peer(quiet) as peer:
        options = stream_options(peer.port, r"(?P<value>[-.\d]+)", scale=-1.0, threshold=-12.0)
        device = line_stream.LineStream("button", options)
        peer.streaming = b"23.9\n12.0\n11.9\n0\n"
        device.open()
        peer.streaming = None
        samples = collect(device, 4)
        first = [sample.values for sample in samples].index((1.0,)) % 4
        assert [sample.values[0] for sample in samples[first - 2 : first + 2]] == [0.0, 0.0, 1.0, 1.0]
        device.close()
    with pytest.raises(ValueError, match="threshold must be finite"):
        stream_options(threshold=float("nan"))


@pytest.mark.parametrize("number", ["9" * 310, "-" + "9" * 310, "9" * 5000, "9" * 17, "1e400", "inf", "nan", "1e308"])
def test_numbers_that_no_instrument_means_are_unreadable(number):
    for pattern, line in (
        (r"(?P<value>\S+)", number),
        (r"(?P<raw>\S+)", number),
        (r"(?P<value>1\.5) (?P<raw>\S+)", f"1.5 {number}"),
        (r"(?P<value>1\.5) (?P<t>\S+)", f"1.5 {number}"),
    ):
        (record,) = line_stream.Decoder(pattern).feed(line.encode() + b"\n")
        if isinstance(record, line_stream.Reading):  # a value of any size, a device's time that it does not know
            assert record.raw is None
            assert math.isfinite(record.value)
            assert not math.isinf(record.t)
            assert number in ("9" * 17, "nan", "1e308")
        else:
            assert record.line.startswith(line.encode()[:20])
