"""Mantracourt ASCII: golden lines, and the driver against a scripted card: each value once, none invented."""

from __future__ import annotations

import math
import threading
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import DeviceError
from drivers.serial_lines.mantracourt_dsc import MantracourtDsc, Options
from drivers.serial_lines.mantracourt_lines import (
    BROKEN,
    NO_VALUE,
    Decoder,
    Number,
    Refused,
    Unreadable,
    decode,
    question,
    told,
)
from tests.drivers.collecting import FOLDER, quiet
from tests.drivers.scripted_peer import Peer, wait_until

FRAMES = tomllib.loads((FOLDER / "mantracourt.toml").read_text())
CARD = {
    b"!001:DPB?": b"+00005.000",
    b"!001:VER?": b"+01031.000",
    b"!001:SERL?": b"+57920.000",
    b"!001:SERH?": b"+00001.000",
    b"!001:STAT?": b"+00000.000",
    b"!001:SYS?": b"+00032.100",
}


def options(port="p", **changed):
    return Options(port, **{"rate": 200.0, "unit": "kg"} | changed)


def card(**changed):
    table = {**CARD, **{f"!001:{name}?".encode(): answer for name, answer in changed.items()}}

    def script(peer, request):
        answer = peer.table.get(request)
        if answer is not None:
            peer.send(answer + b"\r")

    peer = Peer(script, terminator=b"\r")
    peer.table = table
    return peer


def opened(peer, **changed):
    device = MantracourtDsc("cell", options(peer.port, **changed))
    device.open()
    return device


def rows(device, count):
    samples = []
    wait_until(lambda: len(samples.extend(device.drain()) or samples) >= count)
    return samples


@pytest.mark.parametrize("case", FRAMES["number"], ids=lambda case: case["line"])
def test_numbers(case):
    assert decode(case["line"].encode()) == Number(case["value"], case["decimals"])


@pytest.mark.parametrize("case", FRAMES["question"], ids=lambda case: case["name"])
def test_questions(case):
    assert question(case["station"], case["name"]) == bytes.fromhex(case["hex"])


@pytest.mark.parametrize("case", FRAMES["status"], ids=lambda case: str(case["value"]))
def test_status(case):
    assert told(case["value"], NO_VALUE) == case["no_value"]
    assert told(case["value"], BROKEN) == case["broken"]


def test_other_lines():
    assert decode(b"?") == Refused()
    for line in (b"32.1", b"+", b"+1e5", b"nan", b"+-1", b"\xff", b"+00032.100 "):
        assert decode(line) == Unreadable(line)
    for station, name in ((0, "SYS"), (1000, "SYS"), (1, "sys"), (1, "LONGER"), (1, "")):
        with pytest.raises(ValueError, match="one station of 1 to 999"):
            question(station, name)


@given(st.integers(-(10**8), 10**8))
def test_numbers_come_back(thousandths):
    line = f"{thousandths / 1000:+010.3f}".encode()
    assert decode(line) == Number(pytest.approx(thousandths / 1000), 3)


@given(st.binary(max_size=60))
def test_garbage_is_followed_by_a_good_line(garbage):
    assert Decoder().feed(garbage + b"\r+00032.100\r")[-1] == Number(32.1, 3)


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"unit": "lbf"}, "unit must be one of N, mg"),
        ({"station": 0}, "station must be 1 to 999"),
        ({"sign": 2}, "sign must be 1 or -1"),
        ({"timeout": 0.01}, r"timeout must be between 0\.05 and 10 s"),
        ({"baud": 9600}, r"9600 baud carries at most 21/s \(45 characters"),
    ],
)
def test_impossible_options(changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        options(**changed)


def test_rows():
    with card() as peer:
        device = MantracourtDsc("cell", options(peer.port, sign=-1))
        assert device.open() == "Mantracourt DSC 4.07, serial number 123456"
        assert rows(device, 3)[-1].values == pytest.approx((-32.1 * 9.80665, 0.0))
        assert device.health().alive
        assert device.health().bad == 0
        device.close()
        assert not device.health().alive


def test_a_value_that_was_read_is_not_read_again():
    with card() as peer:
        device = opened(peer)
        peer.table[b"!001:STAT?"] = b"+08192.000"
        wait_until(lambda: device.drain() is not None and peer.heard[-2:] == 2 * [b"!001:STAT?"])
        asked = peer.heard.count(b"!001:SYS?")
        for _ in range(20):
            assert device.drain() == []
            threading.Event().wait(0.005)
        assert peer.heard.count(b"!001:SYS?") == asked
        peer.table[b"!001:STAT?"] = b"+00000.000"
        assert rows(device, 1)
        device.close()


def test_no_faster_than_its_rate():
    with card() as peer:
        device = opened(peer, rate=20.0)
        rows(device, 2)
        before, begun = len(peer.heard), threading.Event()
        for _ in range(100):
            device.drain()
            begun.wait(0.002)
        assert len(peer.heard) - before <= 16, "0.2 s at 20/s, two questions each, and slack"
        device.close()


@pytest.mark.parametrize(("bit", "word"), [(5, "above"), (8, "below")])
def test_out_of_range_is_no_value(bit, word):
    with card() as peer:
        device = opened(peer)
        peer.table[b"!001:STAT?"] = b"%+010.3f" % float(1 << bit)
        wait_until(lambda: any(math.isnan(row.values[0]) and row.values[1] == 1 << bit for row in device.drain()))
        assert device.health().alive
        device.close()


def test_a_broken_cell_is_a_fault_until_it_is_gone():
    with card() as peer:
        device = opened(peer)
        peer.table[b"!001:STAT?"] = b"+02048.000"
        wait_until(lambda: device.drain() is not None and not device.health().alive)
        assert device.health().error.startswith("cell reports load cell integrity error: look at the cell")
        peer.table[b"!001:STAT?"] = b"+00000.000"
        wait_until(lambda: device.drain() is not None and device.health().alive)
        device.close()


@pytest.mark.parametrize(
    ("answers", "sentence"),
    [
        ({"DPB": None}, r"no Mantracourt card answers as station 1 on .* 115200 baud 8N1 \('DPB\?' .*, came nothing\)"),
        ({"DPB": b"+0004.000"}, r"sends 4 digits before the point \(DPB\), and its status has 5: set DPB to 5"),
        ({"VER": b"?"}, r"\('VER\?' expected a number, came Refused"),
        ({"STAT": b"+04096.000"}, r"reports shunt calibration is on \(STAT 4096\)"),
        ({"STAT": b"+00512.000"}, "reports system above its range"),
    ],
)
def test_what_is_refused_at_opening(answers, sentence):
    with card(**answers) as peer:
        device = MantracourtDsc("cell", options(peer.port))
        with pytest.raises(DeviceError, match=sentence):
            device.open()
        assert not device.health().alive


def test_answers_that_never_come_are_given_up_and_told():
    with card() as peer:
        device = opened(peer, timeout=0.05)
        peer.table[b"!001:SYS?"] = None
        wait_until(lambda: device.drain() is not None and "no answer to SYS?" in device.health().first_bad)
        peer.table[b"!001:SYS?"] = b"+00001.000"
        wait_until(lambda: any(row.values[0] == pytest.approx(9.80665) for row in device.drain()))
        device.close()


def test_spoilt_lines_are_counted_and_no_row():
    with card() as peer:
        device = opened(peer)
        peer.table[b"!001:SYS?"] = b"+0003\xff2"
        wait_until(lambda: device.drain() is not None and device.health().bad >= 1)
        assert "xff" in device.health().first_bad[0]
        peer.table[b"!001:SYS?"] = b"+00001.000"
        assert rows(device, 1)
        device.close()


def test_a_tare_is_refused_with_what_to_do():
    with card() as peer:
        device = opened(peer)
        with pytest.raises(DeviceError, match="tare by subtraction"):
            device.tare()
        device.close()


def test_a_pulled_cable_and_silence():
    with card() as peer:
        device = opened(peer)
        peer.unplug()
        wait_until(lambda: device.drain() is not None and not device.health().alive)
        assert "check adapter, cable" in device.health().error
        device.close()
        device.close()
    with Peer(quiet, terminator=b"\r") as peer, pytest.raises(DeviceError, match="came nothing"):
        MantracourtDsc("cell", options(peer.port, timeout=0.05)).open()
