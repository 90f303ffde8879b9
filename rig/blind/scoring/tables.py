"""Scores as the tables of the proof: what was taken for what, the worst cells, the open world; `tables` is the JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from operator import attrgetter
from typing import Any

import numpy as np

from rig.blind.design import LADDER, STRENGTHS
from rig.blind.scoring.composites import composite_rows
from rig.blind.scoring.metrics import LARGE, besides, cell, goals, half_named, named_by_strength, ratios
from rig.blind.scoring.rates import Goal, rate
from rig.blind.scoring.score import OPEN_CELLS, TELLABLE, Score


def confusion(scores: Iterable[Score], *names: str) -> dict[str, dict[str, int]]:
    """Truth -> answer -> count."""
    found: dict[str, Counter[str]] = {}
    for s in cell(scores, *names):
        found.setdefault(s.order.label, Counter())[s.answer] += 1
    return {truth: dict(found[truth].most_common()) for truth in sorted(found)}


def worst(scores: Iterable[Score], most: int = 60) -> list[dict[str, Any]]:
    """Cells with the most failures first, without those below faint: what was said in each."""
    by: dict[tuple[str, str], list[Score]] = {}
    for s in (s for s in scores if s.order.cell not in LADDER):
        by.setdefault((s.order.cell, s.order.label), []).append(s)
    rows: list[dict[str, Any]] = []
    for (name, label), group in by.items():
        bad = [s for s in group if not s.good]
        if bad:
            told = [said(s) for s in bad]
            rows.append({"cell": name, "label": label, "n": len(group), "failures": len(bad), "said": told})
    return sorted(rows, key=lambda row: (-row["failures"], row["cell"], row["label"]))[:most]


def said(s: Score) -> dict[str, Any]:
    """One case in short."""
    return {
        "id": s.order.id,
        "truth": list(s.truth),
        "strengths": [round(d, 1) for d in s.strengths],
        "known": list(s.known),
        "verdict": s.said,
        "named": list(s.named),
        "rivals": list(s.rivals),
        "place": s.place,
        "resembles": list(s.resembles),
        "nearest": None if s.near is None else [s.near.rival, round(s.near.left, 1)],
        "case": s.case,
        "statement": s.statement,
        "wired": list(s.wired.said) if s.wired is not None else [],
        "seconds": round(s.seconds, 1),
    }


def instead(group: Iterable[Score], most: int = 6) -> str:
    """What was said where it was not right, the most frequent first."""
    seen = Counter(" + ".join(s.named) or s.said for s in group if not s.right)
    return counts(dict(seen.most_common(most)))


def counts(found: Mapping[str, int]) -> str:
    """Names with how often.

    >>> counts({"heating": 2, "adequate": 1})
    'heating (2), adequate'
    """
    return ", ".join(f"{name} ({n})" if n > 1 else name for name, n in found.items())


def twins(scores: Iterable[Score]) -> list[dict[str, Any]]:
    """Effects that nobody can tell from a neighbour in some recordings; what the whole catalogue says of the same.

    `rivals_stated`: of the same recordings diagnosed by the whole catalogue, in how many is the neighbour beside the
    effect, as finding or rival.
    """
    every = list(scores)
    whole = {s.order.id.split("/", 1)[1]: s for s in cell(every, "plain")}
    groups: dict[tuple[str, str], list[Score]] = {}
    for s in cell(every, *OPEN_CELLS):
        if s.near is not None and not s.counted:
            groups.setdefault((s.order.label, s.near.rival), []).append(s)
    rows = []
    for (effect, rival), group in sorted(groups.items()):
        pairs = [(s, whole.get(s.order.id.split("/", 1)[1])) for s in group]
        stated = [rival in {*w.named, *w.rivals} for s, w in pairs if w is not None and s.order.cell == "removed"]
        left = sorted(s.near.left for s in group if s.near is not None)
        rows.append(
            {
                "effect": effect,
                "twin": rival,
                "runs": len(group),
                "left": [round(left[0], 1), round(left[-1], 1)],
                "rivals_stated": rate(stated).json(),
                "said_instead": dict(Counter(n for s in group for n in (s.named or (s.answer,))).most_common()),
            }
        )
    return rows


def open_world(scores: Iterable[Score]) -> list[dict[str, Any]]:
    """Each effect outside the catalogue: what was said instead, where it can be told from its neighbours."""
    groups: dict[tuple[str, str], list[Score]] = {}
    for s in cell(scores, *OPEN_CELLS):
        groups.setdefault((s.order.cell, s.order.label), []).append(s)
    rows = []
    for (name, effect), group in sorted(groups.items()):
        counted = [s for s in group if s.counted]
        rows.append(
            {
                "cell": name,
                "effect": effect,
                "runs": len(group),
                "counted": len(counted),
                "outcomes": dict(Counter(s.outcome for s in counted)),
                "names": dict(Counter(n for s in counted if s.outcome == "wrong name" for n in s.named).most_common()),
                "places": dict(Counter(s.place for s in counted if s.place).most_common()),
            }
        )
    return rows


def coverage(scores: Iterable[Score]) -> list[dict[str, Any]]:
    """Parameter by parameter."""
    found: dict[tuple[str, str], list[Any]] = {}
    for s in cell(scores, *STRENGTHS):
        for i in s.intervals:
            found.setdefault((i.effect, i.parameter), []).append(i)
    return [
        {
            "effect": effect,
            "parameter": name,
            **rate(i.covers for i in group).json(),
            "median_z": float(np.clip(np.median([i.z for i in group]), -LARGE, LARGE)),
        }
        for (effect, name), group in sorted(found.items())
    ]


def tables(
    scores: Sequence[Score], seeds: int, versions: Sequence[str], undrawn: Sequence[str], draw: str = ""
) -> dict[str, Any]:
    """All of it, for `--json`."""
    quantiles = (0.05, 0.5, 0.95)
    held = {name: ratios(scores, attrgetter(name)) for name in ("model", "baseline", "left")}
    seconds = np.array([s.seconds for s in scores]) if scores else np.zeros(1)
    return {
        "format": "thruster-rig-proof",
        "version": 1,
        "seeds": seeds,
        "draw": draw,
        "answers": len(scores),
        "failed": [said(s) for s in scores if s.failed],
        "diagnosis_versions": list(versions),
        "not_drawn": list(undrawn),
        "tellable": TELLABLE,
        "goals": [_goal(g) for g in goals(scores)],
        "besides": [_goal(g) for g in besides(scores)],
        "confusion": {name: confusion(scores, name) for name in (*STRENGTHS, "form", "variant", "fault", "clean")},
        "power": {e: {str(d): r.json() for d, r in by.items()} for e, by in named_by_strength(scores).items()},
        "half_named": {e: d if np.isfinite(d) else None for e, d in half_named(scores)},
        "open_world": open_world(scores),
        "twins": twins(scores),
        "coverage": coverage(scores),
        "composites": composite_rows(scores),
        "held_out": {name: {str(q): float(np.quantile(v, q)) for q in quantiles} for name, v in held.items() if v.size},
        "seconds": {str(q): float(np.quantile(seconds, q)) for q in (0.5, 0.95, 1.0)},
        "worst": worst(scores),
    }


def _goal(g: Goal) -> dict[str, Any]:
    found = {"what": g.what, "goal": g.wanted, "value": g.value if g.n else None, "n": g.n, "met": g.met}
    return found | ({"low": g.low, "high": g.high} if g.percent else {})
