"""docs/howto/import-a-recording.md: every key of a map, every option, every unit that it names, and its examples."""

import re
import tomllib
from dataclasses import fields
from pathlib import Path

import pytest

from identification.recording import QUANTITY_UNITS
from rig.importing.command import import_command
from rig.importing.mapping import ChannelMap, Column, FileMap, HeaderValue, ImportMap, StreamMap, Time, build_map
from rig.importing.reading.row_filter import parse
from rig.importing.units import conversion
from tests.rig.importing.small_imports import PLAIN

PAGE = (Path(__file__).parents[3] / "docs" / "howto" / "import-a-recording.md").read_text(encoding="utf-8")
TABLES = {"file", "time", "parameters", "columns", "header_values", "streams", "channels"}
"""Keys that are tables and have a heading of their own."""


@pytest.mark.parametrize("cls", [ImportMap, FileMap, Time, Column, HeaderValue, StreamMap, ChannelMap])
def test_every_key_of_a_map_is_on_the_page(cls):
    keys = {field.name for field in fields(cls)} - TABLES - {"text"}
    written = set(re.findall(r"`(\w+)`", PAGE))
    assert keys <= written, keys - written


def test_every_option_is_on_the_page():
    options = {option for parameter in import_command.params for option in parameter.opts if option.startswith("--")}
    assert options - {"--output"} <= set(re.findall(r"--[a-z-]+", PAGE))


def test_the_units_of_the_page_are_known():
    listed = PAGE.split("| quantity | units |")[1].split("\n\n")[0]
    for row in listed.splitlines()[2:]:
        quantity, names = (cell.strip() for cell in row.strip("|").split("|"))
        asked = {"motor_voltage": "bus_voltage", "temperatures": "water_temperature"}.get(quantity, quantity)
        first = next(name.strip() for name in asked.replace("motor_voltage", "bus_voltage").split(","))
        assert first in QUANTITY_UNITS
        for name in re.split(r", | or ", names.split(";")[0]):
            assert conversion(first, name).si


def test_the_examples_of_the_page_are_sound():
    (block,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    assert build_map(tomllib.loads(block), block, "page").streams["cell"].channels["thrust"].sign == -1
    (where,) = re.findall(r'where = "(.*?)"`', PAGE)
    assert len(parse(where)) == 2
    assert build_map({**PLAIN, "file": {"where": where}}, "", "page").file.where == where
