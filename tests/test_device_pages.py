"""Pages of docs/devices: their blocks are files that load, their links lead somewhere, and their sentences are said.

The table of all devices (docs/devices/README.md) has every kind, and each test that a page names is there.
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from dataclasses import fields
from functools import cache
from pathlib import Path

import pytest

from drivers import KINDS
from drivers.modbus.maps import known_maps, load_map
from tests.test_pages import FENCED, anchor, rows

TESTS = Path(__file__).parent
DEVICES = TESTS.parent / "docs" / "devices"
OVERVIEW = DEVICES / "README.md"
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


@pytest.mark.parametrize("page", [page for page in PAGES if page != OVERVIEW], ids=lambda page: page.stem)
def test_devices_of_the_page_are_options_of_their_kind(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Blocks whose first line is a comment with a file's name are that file, beside the bench file."""
    monkeypatch.chdir(tmp_path)
    blocks = [body for language, body in FENCED.findall(page.read_text(encoding="utf-8")) if language in NAMED]
    for body in blocks:
        if name := re.match(r"(?:#|//) (\w+\.(?:toml|dbc))\n", body):
            (tmp_path / name[1]).write_text(body.partition("\n")[2], encoding="utf-8")
    tables = _devices(page)
    assert tables
    for table in tables:
        KINDS[table.pop("kind")].options(**{key: _frozen(value) for key, value in table.items()})


def _devices(page: Path) -> list[dict[str, object]]:
    """Tables `[devices.<name>]` of the page's blocks."""
    known = [body for language, body in FENCED.findall(page.read_text(encoding="utf-8")) if language == "toml"]
    return [table for body in known for table in tomllib.loads(body).get("devices", {}).values()]


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


# -- the table of all devices ----------------------------------------------------------------------------------------

CHECKED = (
    "golden frames",
    "our driver, their device",
    "our simulated device, their client",
    "watchdog measured",
    "faults",
)
MOVES_NOTHING = "it moves nothing"
NAMED_TEST = re.compile(r"`(?:((?:[\w.]+/)*test_\w+\.py)(?:::(\w+))?|::(\w+))`")
"""A file, a test in it, or a test in the file that was named before."""


def table(second: str) -> dict[str, list[str]]:
    """Cells behind the kind, of the overview's table whose second column is called so."""
    (body,) = [part for part in OVERVIEW.read_text(encoding="utf-8").split("\n\n") if f"| kind | {second} |" in part]
    _, *of_kinds = rows(body)
    found = {re.findall(r"`(\w+)`", first)[0]: rest for first, *rest in of_kinds}
    assert len(found) == len(of_kinds), "a kind has two rows"
    return found


def named_tests(text: str) -> Iterator[tuple[Path, str]]:
    """(file, test or "") in their order; a path is below tests/, with or without saying so."""
    file = Path()
    for path, in_it, alone in NAMED_TEST.findall(text):
        file = TESTS / path.removeprefix("tests/") if path else file
        yield file, in_it or alone


@cache
def functions_in(file: Path) -> frozenset[str]:
    """Names of the functions of a file, which is not imported."""
    parts = ast.parse(file.read_text(encoding="utf-8")).body
    return frozenset(part.name for part in parts if isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef))


def test_every_kind_has_a_row_in_both_tables_and_a_page_with_its_bench() -> None:
    assert set(table("golden frames")) == set(table("can't")) == set(KINDS)
    links = dict(re.findall(r"\[`(\w+)`\]\(([\w-]+\.md)\)", OVERVIEW.read_text(encoding="utf-8")))
    assert set(links) == set(KINDS)
    for kind, page in links.items():
        assert kind in {each["kind"] for each in _devices(DEVICES / page)}, f"{page} has no bench with a {kind}"
    assert {*links.values(), OVERVIEW.name} == {page.name for page in PAGES}


def test_every_cell_names_a_test_or_says_why_there_is_none() -> None:
    for kind, cells in table("golden frames").items():
        told = dict(zip(CHECKED, cells, strict=True))
        for column, cell in told.items():
            assert list(named_tests(cell)) or len(cell) > 10, (kind, column)
            assert all(name for _, name in named_tests(cell)), f"{kind}, {column}: a file is no test"
        moves = "watchdog_timeout" in {field.name for field in fields(KINDS[kind].options)}
        watchdog = told["watchdog measured"]
        assert bool(list(named_tests(watchdog))) == moves, kind
        assert (watchdog == MOVES_NOTHING) == (not moves), kind
        assert list(named_tests(told["faults"])), kind


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_test_that_the_page_names_is_there(page: Path) -> None:
    text = FENCED.sub("", page.read_text(encoding="utf-8"))
    assert len(re.findall(r"`[^`\n]*\btest_[^`\n]*`", text)) == len(NAMED_TEST.findall(text)), (
        "one that is no path::test"
    )
    for file, name in named_tests(text):
        assert file.is_file(), file
        assert not name or (name.startswith("test_") and name in functions_in(file)), f"{file.name}::{name}"


def test_extras_are_those_of_the_package() -> None:
    project = tomllib.loads((TESTS.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    needed = {kind: cells[-1].strip("`") for kind, cells in table("can't").items()}
    assert {extra for extra in needed.values() if extra} <= set(project["optional-dependencies"])
    for kind, found in KINDS.items():
        page = next(page for page in PAGES if page != OVERVIEW and kind in {each["kind"] for each in _devices(page)})
        assert bool(needed[kind]) == ("thruster-rig[" in page.read_text(encoding="utf-8")), kind
        assert needed[kind] or isinstance(found.build, type), f"{kind} is built by an extra"
