"""Register maps: those that come with the rig against the golden reply and the manuals, and what is no map."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.modbus.maps import known_maps, load_map, span
from drivers.modbus.maps.numbers import number, other, sane, status, weight

OWN = """
title = "One's own"
source = "tried at the bench"
function = 3
[readings.weight]
register = 10
type = "i16"
"""
LAUMAS = (0x0880, 0, 12345, 0, 12000, 0, 0, 3)
"""40007 to 40014: the golden reply."""


def test_the_golden_reply_is_a_laumas_with_a_negative_gross_weight():
    found = load_map("laumas")
    gross, net = found.readings["gross"], found.readings["net"]
    assert weight(LAUMAS, 6, found, gross, "high_first") == -12345
    assert weight(LAUMAS, 6, found, net, "high_first") == 12000
    flags = status(LAUMAS, 6, found)
    assert flags >> found.status.stable & 1
    assert not any(flags >> bit & 1 for bit in (*found.status.overload, *found.status.fault))
    assert span(found, gross) == (6, 3)
    assert span(found, net) == (6, 5)


def test_a_dini_argeo_as_its_manual_has_it():
    """DGT1S quick start p. 10: 1000 is 00 00 03 E8, 6000 is 00 00 17 70."""
    found = load_map("dini_argeo_dgt")
    block = (0, 0x03E8, 0, 0x1770, 0b0000_0010)
    assert found.function == 4
    assert weight(block, 0, found, found.readings["gross"], "high_first") == -1000
    assert weight(block, 0, found, found.readings["net"], "high_first") == 6000
    assert status((0, 0, 0, 0, 0b11100), 0, found) >> found.status.stable & 1


def test_a_seneca_is_a_float_with_its_unit_in_a_byte():
    found = load_map("seneca_z_sg")
    (net,) = found.readings.values()
    assert span(found, net) == (63, 15)
    assert (number((0x41C8, 0), net.type, "high_first"), number((0, 0x41C8), net.type, "low_first")) == (25.0, 25.0)
    assert found.unit.said(0x0500) == (5, "N")
    assert found.unit.said(0x0001) == (0, "kg")
    assert found.unit.said(0x0600) == (6, "")
    assert found.unit.said(0x0900) == (9, None)


def test_every_map_names_its_source():
    assert known_maps() == ("dini_argeo_dgt", "laumas", "seneca_z_sg")
    for name in known_maps():
        assert "p. " in load_map(name).source


@given(
    st.sampled_from(("u16", "i16", "u32", "i32", "float32")), st.sampled_from(("high_first", "low_first")), st.data()
)
def test_numbers_round_trip(kind, order, draw):
    code = {"u16": ">H", "i16": ">h", "u32": ">I", "i32": ">i", "float32": ">f"}[kind]
    size = struct.calcsize(code)
    data = draw.draw(st.binary(min_size=size, max_size=size))
    words = struct.unpack(f">{size // 2}H", data)
    words = words if order == "high_first" else words[::-1]
    (value,) = struct.unpack(code, data)
    assert number(words, kind, order) == value or math.isnan(value)


def test_the_wrong_number_of_words():
    with pytest.raises(ValueError, match="float32 is not 1 registers"):
        number((1,), "float32", "high_first")


def test_a_float_whose_words_are_exchanged_is_no_weight():
    for value in (25.0, 0.1, -3.75, 412.3, 1e-4):
        high, low = struct.unpack(">HH", struct.pack(">f", value))
        right, wrong = (number((high, low), "float32", order) for order in ("high_first", other("high_first")))
        assert sane((right,), 1000.0)
        if low == 0:
            assert not sane((wrong,), 1000.0), value
    assert sane((0.0, 1.0), 2.0)
    assert not any(sane((value,), 2.0) for value in (math.nan, math.inf, 2.1, 1e-40))


def test_a_map_of_ones_own(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(OWN)
    found = load_map(str(path))
    assert span(found, found.readings["weight"]) == (10, 1)
    assert status((5,), 10, found) == 0


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("title = ", "is not TOML"),
        (OWN.replace('type = "i16"', 'type = "i17"'), "readings.weight.type: Input should be 'u16'"),
        (OWN.replace("function = 3", "function = 6"), "function: Input should be 3 or 4"),
        (OWN.replace("register = 10", "register = 70000"), "readings.weight.register: .* got 70000"),
        (OWN.replace("register = 10", 'register = "10"'), "readings.weight.register: .* got '10'"),
        (OWN + "colour = 3\n", "readings.weight.colour: Unexpected"),
        (OWN.replace('type = "i16"', 'type = "magnitude"'), "a magnitude needs `negative`"),
        (OWN + "negative = 3\n", "others have none"),
        (OWN.replace('type = "i16"', 'type = "magnitude"\nnegative = 3'), r"its sign in \[status\], which is missing"),
        (OWN.partition("[readings")[0] + "readings = {}\n", r"needs a table \[readings"),
        (OWN + "[status]\nregister = 400\n", "391 registers apart, more than the 125"),
        (OWN + '[unit]\nregister = 1\ncodes = { 0 = "stone" }\n', "'stone' is none of N, mg"),
        (OWN + '[division]\nregister = 1\ncodes = { 0 = "a bit" }\n', "'a bit' is no weight"),
    ],
)
def test_what_is_no_map(tmp_path, text, sentence):
    path = tmp_path / "own.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=sentence):
        load_map(str(path))


def test_a_map_that_is_not_there(tmp_path):
    with pytest.raises(ValueError, match=r"cannot be read \(No such file"):
        load_map(str(tmp_path / "none.toml"))
    with pytest.raises(ValueError, match="must be one of dini_argeo_dgt, laumas, seneca_z_sg, or the path"):
        load_map("loomas")
