"""Pages of docs/devices: their blocks are files that load, their links lead somewhere, and their sentences are said."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from drivers import KINDS
from drivers.modbus.maps import known_maps, load_map
from tests.test_pages import FENCED, anchor

DEVICES = Path(__file__).parents[1] / "docs" / "devices"
PAGES = sorted(DEVICES.glob("*.md"))
NAMED = ("toml", "text")
TEXT = (DEVICES / "modbus-cells.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_of_the_page_lead_somewhere(page: Path) -> None:
    for link in re.findall(r"\]\(([^)]+)\)", page.read_text(encoding="utf-8")):
        file, _, place = link.partition("#")
        target = (page.parent / file).resolve()
        assert target.exists(), link
        headings = re.findall(r"^#+ (.+)$", target.read_text(encoding="utf-8"), re.MULTILINE)
        assert not place or place in [anchor(heading) for heading in headings], link


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_devices_of_the_page_are_options_of_their_kind(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Blocks whose first line is a comment with a file's name are that file, beside the bench file."""
    monkeypatch.chdir(tmp_path)
    blocks = [body for language, body in FENCED.findall(page.read_text(encoding="utf-8")) if language in NAMED]
    for body in blocks:
        if name := re.match(r"(?:#|//) (\w+\.(?:toml|dbc))\n", body):
            (tmp_path / name[1]).write_text(body.partition("\n")[2], encoding="utf-8")
    known = [body for language, body in FENCED.findall(page.read_text(encoding="utf-8")) if language == "toml"]
    tables = [table for body in known for table in tomllib.loads(body).get("devices", {}).values()]
    assert tables
    for table in tables:
        KINDS[table.pop("kind")].options(**{key: _frozen(value) for key, value in table.items()})


def _frozen(value: object) -> object:
    """As the loader hands it on: arrays are tuples."""
    return tuple(_frozen(each) for each in value) if isinstance(value, list) else value


def test_the_map_of_the_page_is_one(tmp_path: Path) -> None:
    (own,) = [body for language, body in FENCED.findall(TEXT) if language == "toml" and "[readings" in body]
    (tmp_path / "own.toml").write_text(own, encoding="utf-8")
    found = load_map(str(tmp_path / "own.toml"))
    assert found.unit is not None
    assert found.unit.said(0x040F) == (4, "N")
    assert found.division is not None
    assert found.division.said(0x040F) == (15, "0.001")


def test_the_page_has_every_map_with_its_registers() -> None:
    for name in known_maps():
        found = load_map(name)
        assert f"`{name}`" in TEXT or name in TEXT
        base = 40001 if found.function == 3 else 30001
        for reading in found.readings.values():
            assert str(base + reading.register) in TEXT
        assert found.status is not None
        assert str(base + found.status.register) in TEXT


def test_the_rates_of_the_page() -> None:
    """Those that 9600 baud carry."""
    for name, rate in (("seneca_z_sg", 19), ("laumas", 36)):
        scale = {"unit": "kg"} | ({} if name == "seneca_z_sg" else {"decimals": 3})
        KINDS["modbus_cell"].options("p", name, float(rate), **scale)
        with pytest.raises(ValueError, match="baud carries at most"):
            KINDS["modbus_cell"].options("p", name, rate + 1.0, **scale)
        assert f"{rate} times a second" in TEXT or f"a Laumas {rate} times" in TEXT
