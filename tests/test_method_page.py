"""docs/method.md quotes what its example says, thresholds as they are, and code that is there."""

from __future__ import annotations

import importlib.util
import re
from itertools import chain
from pathlib import Path

import pytest

from identification.mismatch.answer.explained.explain import explained
from identification.mismatch.answer.explained.trace import Trace
from identification.mismatch.policy import thresholds
from rig.diagnose.explanation import explanation_text
from rig.diagnose.typed import TITLE, typed

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "method.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```\n(\d+\. .*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w])")
CLOSE = 0.02
"""Another machine rounds otherwise, and draws are compared with it."""
CHANCE, CLOSE_CHANCE = re.compile(r"(?<=\(p = )[\d.]+"), 0.1
"""A share of draws, of which it makes more."""
COUNTED, CLOSE_COUNT = 100, 0.005
"""Whole numbers from here on are counts of rows and trials, or sums that hardly move."""


@pytest.fixture(scope="module")
def found() -> Trace:
    path = ROOT / "examples" / "explain_dead_band_and_drift.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    trace = module.trace()
    assert isinstance(trace, Trace)
    return trace


@pytest.fixture(scope="module")
def said(found: Trace) -> list[str]:
    return explanation_text(explained(found)).splitlines()


def words(line: str) -> list[str]:
    return NUMBER.sub("#", line).split()


def numbers(line: str) -> list[float]:
    return [float(x) for x in NUMBER.findall(line)]


def same(quoted: str, line: str) -> bool:
    chances, drawn = ([float(p) for p in CHANCE.findall(each)] for each in (quoted, line))
    if chances != pytest.approx(drawn, rel=CLOSE_CHANCE):
        return False
    told, there = (numbers(CHANCE.sub("0", each)) for each in (quoted, line))
    if words(quoted) != words(line) or told != pytest.approx(there, rel=CLOSE):
        return False
    counts = [(a, b) for a, b in zip(told, there, strict=True) if a.is_integer() and a >= COUNTED]
    return all(a == pytest.approx(b, rel=CLOSE_COUNT) for a, b in counts)


def test_every_line_that_is_quoted_is_said_in_this_order(said):
    assert len(BLOCKS) == 10
    for block in BLOCKS:
        head, *lines = (line for line in block.splitlines() if line.strip() != "...")
        at = next(i for i, line in enumerate(said) if same(head, line))
        for quoted in lines:
            at = next((i for i in range(at + 1, len(said)) if same(quoted, said[i])), len(said))
            assert at < len(said), quoted


def test_thresholds_have_the_values_that_are_quoted():
    known = {name.rpartition(".")[2]: float(value) for name, value in thresholds()}
    quoted = re.findall(r"`([A-Z][A-Z_0-9]+)`\s+\(([\d.e-]+)\)", PAGE)
    assert len(quoted) > 20
    assert [(name, known[name]) for name, _ in quoted] == [(name, float(value)) for name, value in quoted]


def test_code_that_is_named_is_there():
    named = re.findall(r"`((?:identification|tests|examples)/[\w/]+(?:\.py|/))`", PAGE)
    beside = re.findall(r"`(identification/mismatch/\w+/)(?:\w+\.py)?`[^\n]*?\(([^)]*\.py[^)]*)\)", PAGE)
    files = chain(named, (room + name for room, told in beside for name in re.findall(r"`(\w+\.py)`", told)))
    assert [name for name in files if not (ROOT / name).exists()] == []


def test_the_equations_that_the_how_to_quotes(found):
    page = (ROOT / "docs" / "howto" / "diagnose.md").read_text(encoding="utf-8")
    quoted = page.partition(f"    {TITLE}\n")[2].partition("\n\n")[0].splitlines()
    lines = list(typed(found.diagnosis.equations, 98))
    assert len(quoted) == len(lines)
    assert all(same(a, b) for a, b in zip(quoted, lines, strict=True))
