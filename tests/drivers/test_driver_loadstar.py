"""Loadstar DI-1000: golden lines, and the driver against a scripted interface in both of its streams."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DeviceError, LinkError
from drivers.serial_lines.loadstar import Loadstar, Options
from drivers.serial_lines.loadstar_lines import Counts, Decoder, Text, Value, decode, encode
from tests.drivers.collecting import FOLDER, collect
from tests.drivers.scripted_peer import Peer, wait_until

FRAMES = tomllib.loads((FOLDER / "loadstar.toml").read_text())
ANSWERS = {b"": b"A", b"MODEL": b"FCM DI-1000", b"ID": b"F1234-5678", b"LC": b"100.00", b"UNIT": b"LB",
           b"SWC": b"0.0000250000", b"TARE": b"Tared"}  # fmt: skip
POUND = 9.80665 * 0.45359237


def interface(streams=None, **changed):
    """Answers of a table; `UNIT=b"N"` changes one, None takes it away. Streams WC and H until it gets an empty line."""
    table = ANSWERS | {name.encode(): answer for name, answer in changed.items()}
    streams = {b"WC": b"      2.5000\r\n", b"H": b"-0000C1\r 000100\r"} if streams is None else streams

    def script(peer, request):
        peer.streaming = streams.get(request)
        answer = table.get(request, b"E")
        if answer is not None and request not in streams:
            peer.send(answer + b"\r\n")

    peer = Peer(script, terminator=b"\r")
    peer.table = table
    return peer


def options(port="p", **changed):
    return Options(port, **({"rate": 500.0, "baud": 230400, "timeout": 0.4} | changed))


def opened(peer, **changed):
    device = Loadstar("cell", options(peer.port, **changed))
    device.open()
    return device


@pytest.mark.parametrize("case", FRAMES["line"], ids=lambda case: case["text"])
def test_golden_lines(case):
    found = decode(case["text"].encode())
    if "counts" in case:
        assert found == Counts(case["counts"])
    elif "value" in case:
        assert found == Value(case["value"])
    else:
        assert isinstance(found, Text)
        assert found.words == case["words"]


@given(st.integers(-(2**24) + 1, 2**24 - 1))
def test_counts_come_back(counts):
    assert decode(f"{'-' if counts < 0 else ' '}{abs(counts):06X}".encode()) == Counts(counts)


@given(st.floats(-1e6, 1e6))
def test_values_come_back(value):
    text = f"{value:12.4f}"
    (found,) = Decoder().feed(f"{text}\r\n".encode())
    assert found == Value(float(text))


@given(st.binary(max_size=40))
def test_garbage_is_followed_by_a_good_line(garbage):
    assert Decoder().feed(garbage + b"\r 000100\r")[-1] == Counts(256)


def test_a_line_that_lost_a_character_is_none():
    for line in (b"     2.5000", b"      2.500", b"0000C1", b"-0000C", b"      2.5000 000100", b" 00 0C1"):
        assert isinstance(decode(line), Text), line
    with pytest.raises(ValueError, match="printable"):
        encode("A\r")


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"mode": "binary"}, "mode must be decimal or hex"),
        ({"baud": 9600}, "carries at most 69/s"),
        ({"sign": 0}, "sign must be 1 or -1"),
        ({"unit": "furlong"}, "unit must be one of"),
        ({"gain_std": 0.5}, "gain_std is relative"),
        ({"timeout": 0.0}, "timeout must be"),
    ],
)
def test_impossible_options(changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        options(**changed)


def test_values_in_its_unit():
    with interface() as peer:
        device = Loadstar("cell", options(peer.port, sign=-1))
        assert device.open() == "Loadstar FCM DI-1000, F1234-5678, capacity 100.00"
        (row, *_) = collect(device, 5)
        assert row.values == pytest.approx((-2.5 * POUND,))
        assert device.health().bad == 0
        device.close()
        wait_until(lambda: peer.heard[-1] == b"")


def test_raw_counts_and_those_to_ignore():
    with interface(streams={b"H": b"-0000C1\r-000001\r 000100\r"}) as peer:
        device = opened(peer, mode="hex", unit="lb")
        rows = collect(device, 6)
        assert [channel.name for channel in device.streams[0].channels] == ["thrust", "raw"]
        assert {row.values[1] for row in rows} == {-193.0, 256.0}
        assert rows[0].values[0] == pytest.approx(rows[0].values[1] * 2.5e-5 * POUND)
        assert device.ignored >= 2
        assert device.health().bad == 0
        device.close()


def test_a_spoilt_line_is_counted():
    with interface() as peer:
        device = opened(peer)
        peer.send(b"    2.\xff000\r\n")
        wait_until(lambda: device.drain() is not None and device.health().bad >= 1)
        assert device.health().alive
        device.close()


def test_tare_in_the_interface_and_the_stream_goes_on():
    with interface() as peer:
        device = opened(peer)
        device.tare()
        assert b"TARE" in peer.heard
        assert collect(device, 3)
        peer.table[b"TARE"] = b"E"
        with pytest.raises(DeviceError, match="TARE expected 'Tared'"):
            device.tare()
        device.close()


@pytest.mark.parametrize(
    ("answers", "changed", "sentence"),
    [
        ({"": None}, {}, r"no Loadstar interface answers .* \(an empty command expected 'A', came nothing\)"),
        ({"MODEL": b"E"}, {}, "MODEL expected a name with DI-100 or DI-1000, came"),
        ({"UNIT": b"PSI"}, {}, "shows PSI, which is no force"),
        ({"UNIT": b"Kg"}, {"unit": "N"}, "shows Kg, the bench file says N"),
        ({"SWC": b"E"}, {"mode": "hex"}, "SWC expected the weight of one count; a DI-1000UHS-1K alone has hex mode"),
        ({"SWC": b"0.0"}, {"mode": "hex"}, "SWC expected the weight of one count"),
    ],
)
def test_what_is_refused_at_opening(answers, changed, sentence):
    with interface(**answers) as peer:
        device = Loadstar("cell", options(peer.port, **changed))
        with pytest.raises(DeviceError, match=sentence):
            device.open()
        assert not device.health().alive


def test_a_model_that_does_not_stream():
    with interface(streams={b"WC": None}) as peer, pytest.raises(DeviceError, match="sends no values within"):
        opened(peer)


def test_a_pulled_cable():
    with interface() as peer:
        device = opened(peer)
        peer.unplug()
        wait_until(lambda: device.drain() is not None and not device.health().alive)
        with pytest.raises(LinkError):
            device.tare()
        device.close()
        device.close()
