"""docs/physics: a page for every effect, its parameters as in the class, its example running."""

from __future__ import annotations

import doctest
import re
from dataclasses import replace
from pathlib import Path

import pytest

from identification.physics.catalogue import CATALOGUE
from identification.physics.term import Scale, Term
from identification.physics.vehicle.catalogue import CATALOGUE as VEHICLE

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "docs" / "physics"
WITHOUT_CLASS = ("periodic_disturbance", "channel_fault")
"""Found by identification.mismatch.periodic.periodic_disturbances and faults."""
IDS = (*dict.fromkeys(t.id for t in (*CATALOGUE, *VEHICLE)), *WITHOUT_CLASS)
SECTIONS = (
    "Formula",
    "Source",
    "Sweep that reveals it",
    "Confused with",
    "When the channel is not recorded",
    "Example",
)
LONG = Scale(
    driver=17.0,
    driver_unit="V",
    thrust=131.0,
    duration=611.0,
    interval=0.013,
    spacing=0.1,
    flow=0.7,
    reading=139.0,
    noise=0.1,
    torque=6.1,
)
SHORT = replace(LONG, driver=44.0, thrust=2.3, duration=37.0, interval=0.002, reading=3.1, torque=0.09, spacing=0.01)


def page(effect: str) -> str:
    return (PAGES / f"{effect}.md").read_text(encoding="utf-8")


def sections(effect: str) -> dict[str, str]:
    parts = re.split(r"^## (.+)$", page(effect), flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def cells(line: str) -> list[str]:
    return [c.strip() for c in re.split(r"(?<!\\)\|", line)[1:-1]]


def size(expression: str, scale: Scale) -> float:
    """Value of a bound such as `-0.1 T_max / V_max^2` or `max(60, 0.7 duration)`."""
    while found := re.search(r"(max|min)\(([^()]*)\)", expression):
        best = (max if found[1] == "max" else min)(size(part, scale) for part in found[2].split(", "))
        expression = expression[: found.start()] + repr(best) + expression[found.end() :]
    sizes = {
        "V_max": scale.driver,
        "T_max": scale.thrust,
        "U_max": scale.flow,
        "Q_max": scale.torque,
        "duration": scale.duration,
        "interval": scale.interval,
        "spacing": scale.spacing,
        "reading": scale.reading,
    }
    value, over = -1.0 if expression.startswith("-") else 1.0, False
    for word in expression.lstrip("-").split():
        if word == "/":
            over = True
            continue
        name, _, power = word.partition("^")
        number = (sizes[name] if name in sizes else float(name)) ** int(power or 1)
        value, over = value / number if over else value * number, False
    return value


def rows_of(term: Term) -> list[list[str]]:
    """Lines of the parameter table that speak of this form."""
    lines = [cells(line) for line in sections(term.id)["Formula"].splitlines() if line.startswith("|")]
    return [row for row in lines[2:] if {"both", "all", term.form} & set(row[0].split(", "))]


def test_bounds_are_read() -> None:
    assert size("0.6 V_max", LONG) == pytest.approx(0.6 * 17)
    assert size("-0.1 T_max / V_max^2", LONG) == pytest.approx(-0.1 * 131 / 17**2)
    assert size("3 T_max / V_max / U_max", LONG) == pytest.approx(3 * 131 / 17 / 0.7)
    assert size("max(30, min(300, 0.5 duration))", LONG) == 300.0
    assert size("max(30, min(300, 0.5 duration))", SHORT) == 30.0


def test_one_page_for_each_effect_and_no_other() -> None:
    assert {p.stem for p in PAGES.glob("*.md")} == {*IDS, "README"}


@pytest.mark.parametrize("effect", IDS)
def test_a_page_says_all_that_a_page_says(effect: str) -> None:
    text = page(effect)
    assert text.startswith(f"# `{effect}`\n")
    assert re.search(r"^\*\*Left out:\*\* \S.*\.$", text, re.MULTILINE)
    found = sections(effect)
    assert tuple(found) == SECTIONS
    assert all(body.strip() for body in found.values())
    assert found["Source"].lstrip().startswith("- ")
    assert sum(line.startswith("| ") for line in found["Confused with"].splitlines()) >= 3
    for link in re.findall(r"\]\(([^)]+)\)", text):
        assert (PAGES / link).exists(), link


@pytest.mark.parametrize("term", CATALOGUE, ids=lambda t: f"{t.id}-{t.form}")
def test_parameters_are_those_of_the_class(term: Term) -> None:
    formula = sections(term.id)["Formula"]
    assert f"`{term.stage}`" in formula
    assert not term.form or f"`{term.form}`" in formula
    rows = rows_of(term)
    for scale in (LONG, SHORT):
        parameters = term.parameters(scale)
        assert [row[1].split("`")[1] for row in rows] == [p.name for p in parameters]
        for row, p in zip(rows, parameters, strict=True):
            assert row[2] == p.unit
            assert size(row[3].strip("`"), scale) == pytest.approx(p.low)
            assert size(row[4].strip("`"), scale) == pytest.approx(p.high)
            if p.neutral is not None:
                assert size(row[5], scale) == pytest.approx(p.neutral)


@pytest.mark.parametrize("effect", IDS)
def test_the_example_runs(effect: str) -> None:
    found = doctest.testfile(str(PAGES / f"{effect}.md"), module_relative=False, optionflags=doctest.FAIL_FAST)
    assert found.attempted > 3
    assert found.failed == 0


def test_the_example_of_the_how_to_runs() -> None:
    found = doctest.testfile(str(ROOT / "docs" / "howto" / "add-a-physics-term.md"), module_relative=False)
    assert found.attempted > 3
    assert found.failed == 0


def test_the_index_has_every_effect_as_its_class_has_it() -> None:
    lines = [cells(line) for line in (PAGES / "README.md").read_text(encoding="utf-8").splitlines()]
    listed = {row[0]: row for row in lines if row and row[0].startswith("[")}
    assert set(listed) == {f"[{i}]({i}.md)" for i in IDS}
    for term in {t.id: t for t in reversed(CATALOGUE)}.values():  # the first form; another may be a proxy
        row = listed[f"[{term.id}]({term.id}.md)"]
        assert row[1] == f"`{term.stage}`"
        assert row[2] == term.physics
        assert row[4] == (", ".join(f"`{n}`" for n in term.needs) or "-")
