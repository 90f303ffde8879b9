"""Frames of Modbus RTU: golden bytes both ways, pieces, noise, and what is no answer."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.modbus.rtu import Decoder, Read, Refusal, Registers, Unreadable, crc16, framed, gap
from tests.drivers.collecting import FOLDER
from tests.drivers.modbus_peer import crc

GOLDEN = tomllib.loads((FOLDER / "modbus_rtu.toml").read_text())
ASKED = Read(1, 3, 6, 8)
REPLY = bytes.fromhex(GOLDEN["reply"][0]["frame"])


def answered(data, request=ASKED):
    decoder = Decoder()
    decoder.expect(request)
    return decoder.feed(data)


@pytest.mark.parametrize("case", GOLDEN["request"], ids=lambda case: case["frame"])
def test_requests(case):
    request = Read(case["address"], case["function"], case["register"], case["count"])
    assert request.encode() == bytes.fromhex(case["frame"])


def test_the_golden_reply_and_exception():
    (reply,), (exception,) = GOLDEN["reply"], GOLDEN["exception"]
    assert bytes.fromhex(reply["request"]) == ASKED.encode()
    assert answered(REPLY) == [Registers(tuple(reply["words"]), 6)]
    assert answered(bytes.fromhex(exception["frame"])) == [Refusal(exception["code"])]
    assert str(Refusal(2)) == "exception 2 (no such register)"
    assert ASKED.reply_characters == len(REPLY)


def test_checksums():
    for kind in GOLDEN.values():
        for case in kind:
            assert crc16(bytes.fromhex(case["frame"])) == 0


@given(st.binary(max_size=60))
def test_the_checksum_is_that_of_another_implementation(data):
    assert framed(data) == crc(data)


@given(
    st.lists(st.integers(0, 0xFFFF), min_size=1, max_size=125), st.sampled_from((3, 4)), st.integers(1, 247), st.data()
)
def test_a_reply_in_any_pieces(words, function, address, draw):
    body = bytes((address, function, 2 * len(words))) + b"".join(word.to_bytes(2, "big") for word in words)
    cut = draw.draw(st.integers(0, len(body)))
    decoder = Decoder()
    decoder.expect(Read(address, function, 0, len(words)))
    frame = crc(body)
    assert decoder.feed(frame[:cut]) == []
    assert decoder.waiting
    assert decoder.feed(frame[cut:]) == [Registers(tuple(words), 0)]
    assert not decoder.waiting


def test_bytes_beside_a_reply_are_told():
    """An adapter that hears itself, or the glitch of a line that turns round."""
    echo = ASKED.encode()
    beside, found = answered(echo + REPLY)
    assert beside == Unreadable(f"bytes beside a reply: {echo.hex(' ')}")
    assert isinstance(found, Registers)
    assert answered(b"\x00" + REPLY + b"\xff")[0] == Unreadable("bytes beside a reply: 00 ff")


def test_what_nobody_asked_for():
    assert Decoder().feed(REPLY)[0].text.startswith("bytes that answer nothing: 01 03 10")
    assert Decoder().feed(b"") == []


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"", "no reply"),
        (REPLY[:-1] + b"\x00", "a reply whose checksum is wrong: 01 03 10"),
        (REPLY[:3], "a reply whose checksum is wrong: 01 03 10"),
        (crc(b"\x02" + REPLY[1:-2]), "a reply of address 2 to a request to 1: 02 03"),
        (crc(b"\x01\x03\x02\x00\x07"), "a reply to something else: 01 03 02"),
        (crc(b"\x01\x04\x10" + bytes(16)), "a reply to something else: 01 04"),
    ],
)
def test_why_there_is_no_reply(data, why):
    decoder = Decoder()
    decoder.expect(ASKED)
    assert decoder.feed(data) == []
    assert decoder.unanswered().startswith(why)
    decoder.expect(ASKED)
    assert decoder.feed(REPLY) != [], "what came before is forgotten"


@given(st.binary(max_size=400))
def test_garbage_and_then_a_reply(noise):
    decoder = Decoder()
    decoder.expect(ASKED)
    decoder.feed(noise)
    decoder.expect(ASKED)
    assert decoder.feed(REPLY)[-1] == Registers(tuple(GOLDEN["reply"][0]["words"]), 6)


def test_silence_between_frames():
    assert gap(9600, 10) == pytest.approx(3.5 * 10 / 9600)
    assert gap(9600, 11) == pytest.approx(3.5 * 11 / 9600)
    assert gap(38400, 10) == gap(115200, 11) == 1.75e-3


@pytest.mark.parametrize(
    ("request_", "sentence"),
    [
        ((0, 3, 0, 1), "address must be 1 to 247, not 0"),
        ((248, 3, 0, 1), "not 248"),
        ((1, 3, 0, 126), "1 to 125 registers, not 126"),
        ((1, 3, 0, 0), "not 0"),
        ((1, 3, 65535, 2), "65535 to 65536 are not 0 to 65535"),
        ((1, 3, -1, 1), "are not 0 to 65535"),
    ],
)
def test_impossible_requests(request_, sentence):
    with pytest.raises(ValueError, match=sentence):
        Read(*request_)
