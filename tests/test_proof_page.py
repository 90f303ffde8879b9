"""docs/proof.md tells what the scores in benchmarks/proof say."""

from __future__ import annotations

import re
from math import inf
from pathlib import Path

import pytest

from rig.blind.design import ORACLE, STRENGTHS
from rig.blind.score_file import read
from rig.blind.scoring.metrics import besides, goals, half_named, named_by_strength
from rig.blind.scoring.rates import Goal
from rig.blind.scoring.score import Score
from rig.blind.scoring.tables import confusion, open_world

ROOT = Path(__file__).parents[1]
WORDS = {"yes": "met", "reached": "reached", "open": "open", "no": "missed"}
PAGE = (ROOT / "docs" / "proof.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def scores() -> list[Score]:
    return [known.score for known in read(ROOT / "benchmarks" / "proof" / "scores.jsonl.gz")]


def measured(goal: Goal) -> str:
    if not goal.percent:
        return f"{goal.value:.3f} (n {goal.n:,})"
    return f"{100 * goal.value:.1f} % ({100 * goal.low:.1f} to {100 * goal.high:.1f}, n {goal.n:,})"


def missing(rows: list[str]) -> list[str]:
    assert rows
    return [row for row in rows if row not in PAGE]


def test_goals_and_what_stands_beside_them(scores):
    wanted = [
        f"| {g.what.replace('_', ' ')} | {measured(g)} | {g.wanted} | {WORDS[g.met]} |" for g in goals(scores) if g.n
    ]
    assert not missing(wanted + [f"| {g.what} | {measured(g)} |" for g in besides(scores) if g.n])
    assert f"{len(scores):,} cases" in PAGE


def test_strengths(scores):
    half = dict(half_named(scores))
    rows = []
    for effect, by in named_by_strength(scores).items():
        rates = " | ".join(f"{r.hits}/{r.n}" for _, r in sorted(by.items()))
        d = half.get(effect, inf)
        needs = f"{d:.1f} | {d / ORACLE:.2f}" if d < inf else " | "
        rows.append(f"| `{effect}` | {rates} | {needs} |")
    assert not missing(rows)


def test_what_was_answered(scores):
    found = [confusion(scores, strength) for strength in STRENGTHS]
    rows = []
    for effect in found[0]:
        cells = []
        for answers in (dict(each[effect]) for each in found):
            counts = [answers.pop(name, 0) for name in (effect, "among rivals", "unexplained", "adequate")]
            cells.append(" / ".join(map(str, (*counts, sum(answers.values())))))
        rows.append(f"| `{effect}` | {' | '.join(cells)} |")
    assert not missing(rows)


def test_open_world(scores):
    order = ("located", "located, named", "misplaced", "wrong name", "missed")
    rows = [
        f"| `{w['effect']}`{', removed' if w['cell'] == 'removed' else ''} | {w['counted']} of {w['runs']} | "
        + " | ".join(str(w["outcomes"].get(outcome, 0)) for outcome in order)
        for w in open_world(scores)
        if w["counted"]
    ]
    assert not missing(rows)


def test_versions(scores):
    versions = {known.version for known in read(ROOT / "benchmarks" / "proof" / "scores.jsonl.gz")}
    assert versions == set(re.findall(r"one version of the diagnosis \(`(\w+)`\)", PAGE))


def test_lanes_of_recordings():
    lanes = [known.score for known in read(ROOT / "benchmarks" / "proof" / "lanes.jsonl.gz")]
    wanted = [f"| {g.what.replace('_', ' ')} | {measured(g)} |" for g in (*goals(lanes), *besides(lanes)) if g.n]
    assert len(wanted) > 40
    assert not [row for row in wanted if row not in PAGE and not row.startswith("| crashed")]
