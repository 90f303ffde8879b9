"""Sartorius SBI: golden lines, and the driver against a scripted balance: one question at a time, nothing invented."""

from __future__ import annotations

import math
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DeviceError
from drivers.ports.lines import LineCutter
from drivers.serial_lines.sartorius_lines import Fault, Text, Unreadable, Weight, decode, encode
from drivers.serial_lines.sartorius_sbi import Options, SartoriusSbi
from tests.drivers.collecting import FOLDER
from tests.drivers.scripted_peer import Peer, wait_until

FRAMES = tomllib.loads((FOLDER / "sartorius.toml").read_text())
READING = b"N     +   123.56 g  "
BALANCE = {
    b"\x1bP": READING,
    b"\x1bx1_": b"            LA620S  ",
    b"\x1bx2_": b"          37454321  ",
    b"\x1bx3_": b"          00-37-09  ",
}


def options(port="p", **changed):
    return Options(port, **{"rate": 30.0, "framing": "8N1", "timeout": 0.3} | changed)


def balance(printed=READING):
    """`printed`: for ESC P; None: nothing."""

    def script(peer, request):
        answer = peer.table.get(request)
        if answer is not None:
            peer.send(answer + b"\r\n")

    peer = Peer(script)
    peer.table = {**BALANCE, b"\x1bP": printed}
    return peer


def opened(peer, **changed):
    device = SartoriusSbi("cell", options(peer.port, **changed))
    device.open()
    return device


def rows(device, count):
    samples = []
    wait_until(lambda: len(samples.extend(device.drain()) or samples) >= count)
    return samples


@pytest.mark.parametrize("case", FRAMES["weight"], ids=lambda case: case["line"].strip())
def test_golden_lines(case):
    assert decode(case["line"].encode()) == Weight(case["value"], case["unit"])


@pytest.mark.parametrize("case", FRAMES["fault"], ids=lambda case: case["text"])
def test_golden_faults(case):
    assert decode(case["line"].encode()) == Fault(case["text"])


@pytest.mark.parametrize("case", FRAMES["command"], ids=lambda case: case["name"])
def test_golden_commands(case):
    assert encode(case["name"]) == bytes.fromhex(case["hex"])


def test_other_lines():
    for line in (b"     High     ", b"Stat       Low      ", b"H"):
        assert math.isnan(decode(line).value)
    for line in (b"LA620S", b"+ 12.3.4   g  ", b"+          g  ", b"+   123.56 g", b"1e5"):
        assert decode(line) == Text(line.decode().strip())
    for line in (b"\xff", b"+   12\x003.56 g  "):
        assert decode(line) == Unreadable(line)
    for command in ("p", "PP", "x1", "\n", ""):
        with pytest.raises(ValueError, match="an SBI command is"):
            encode(command)


@given(st.integers(-99_999, 99_999), st.sampled_from(["g", "kg", "mg", ""]), st.sampled_from(["", "N     "]))
def test_weights_come_back(hundredths, unit, identifier):
    shown = f"{abs(hundredths) / 100:8.2f}"
    line = f"{identifier}{'-' if hundredths < 0 else '+'} {shown} {unit:<3}"
    assert decode(line.encode()) == Weight(pytest.approx(hundredths / 100), unit)


@given(st.binary(max_size=60))
def test_garbage_is_followed_by_a_good_line(garbage):
    assert decode(LineCutter().feed(garbage + b"\r\n+   123.56 g  \r\n")[-1]) == Weight(123.56, "g")


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"unit": "pcs"}, "unit must be one of N, mg"),
        ({"sign": 0}, "sign must be 1 or -1"),
        ({"timeout": 0.0}, "timeout must be between 0 and 10 s"),
        ({"baud": 1200, "framing": "7O1"}, r"1200 baud carries at most 5/s \(26 characters"),
    ],
)
def test_impossible_options(changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        options(**changed)


def test_rows():
    with balance() as peer:
        device = SartoriusSbi("cell", options(peer.port, sign=-1))
        assert device.open() == "Sartorius LA620S, version 00-37-09, serial number 37454321"
        found = rows(device, 3)
        assert [row.values for row in found] == [(pytest.approx(-0.12356 * 9.80665), 1.0)] * len(found)
        peer.table[b"\x1bP"] = b"N     +   200.00    "
        wait_until(lambda: any(row.values == (pytest.approx(-0.2 * 9.80665), 0.0) for row in device.drain()))
        assert device.health().alive
        device.close()
        device.close()


def test_a_unit_that_is_not_said_is_asked_for():
    with balance(b"N     +   123.56    ") as peer:
        with pytest.raises(DeviceError, match="says its unit only while it is stable, and said none: give unit"):
            opened(peer)
        device = opened(peer, unit="g")
        assert rows(device, 1)[0].values == (pytest.approx(0.12356 * 9.80665), 0.0)
        device.close()


@pytest.mark.parametrize(
    ("printed", "sentence"),
    [
        (None, "no balance with SBI answers"),
        (b"Stat     Err  54    ", "came 'Stat     Err  54    '"),
        (b"Stat     High       ", "is out of its range"),
        (b"N     +   123.56 pcs", "said pcs: give unit"),
        (b"N     +   123.56 kg ", "shows kg, the bench file says g"),
    ],
)
def test_what_is_not_opened(printed, sentence):
    with balance(printed) as peer:
        changed = {"unit": "g"} if "bench file says" in sentence else {}
        with pytest.raises(DeviceError, match=sentence):
            opened(peer, **changed)


def test_faults_of_the_balance_are_those_of_the_link_until_a_reading_comes():
    with balance() as peer:
        device = opened(peer)
        for printed, sentence in (
            (b"Stat     Err  54    ", "cell reports Err 54"),
            (b"N     +   123.56 kg ", "cell changed its unit from g to kg"),
        ):
            peer.table[b"\x1bP"] = printed
            wait_until(lambda: device.drain() is not None and not device.health().alive)
            assert sentence in device.health().error
            peer.table[b"\x1bP"] = READING
            rows(device, 1)
            assert device.health().alive
        peer.table[b"\x1bP"] = b"Stat     Low        "
        wait_until(lambda: any(math.isnan(row.values[0]) for row in device.drain()))
        assert device.health().alive
        device.close()


def test_silence_is_counted_and_what_nobody_asked_for_is_no_row():
    with balance() as peer:
        device = opened(peer, timeout=0.1)
        rows(device, 1)
        peer.table[b"\x1bP"] = None
        wait_until(lambda: device.drain() is not None and "no answer to ESC P" in device.health().first_bad)
        asked = len(peer.heard)
        peer.send(b"N     +   888.88 g  \r\nN     +   999.99 g  \r\n")
        found = []
        wait_until(lambda: found.extend(device.drain()) or "N     +   999.99 g  " in device.health().first_bad)
        assert [row.values[0] for row in found] in ([], [pytest.approx(0.88888 * 9.80665)])
        assert len(peer.heard) - asked <= 2, "one question at a time"
        with pytest.raises(DeviceError, match="waits for stability before it tares"):
            device.tare()
        device.close()


def test_a_cable_that_is_pulled():
    with balance() as peer:
        device = opened(peer)
        rows(device, 1)
        peer.unplug()
        wait_until(lambda: device.drain() is not None and not device.health().alive)
        device.close()
