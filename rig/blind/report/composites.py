"""Section of the page of `rig prove`: several effects of field size at once, and one more in a second recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rig.blind.report import figures
from rig.blind.report.figures import Row
from rig.blind.scoring.composites import CLEAR
from rig.blind.scoring.metrics import by_label
from rig.blind.scoring.rates import Rate, rate
from rig.blind.scoring.score import Score
from rig.blind.scoring.tables import counts, instead
from rig.report.page import Picture, Section, Table
from rig.report.style import Plot

CELLS = {"field": "Effects of field size", "difference": "One effect more in a second recording"}


def composites_section(scores: Sequence[Score], tables: Mapping[str, Any]) -> Section | None:
    """The section on recordings that conceal several effects at once; None where there were none."""
    parts: list[Picture | Table] = []
    for name, title in CELLS.items():
        rows = [row for row in tables["composites"] if row["cell"] == name]
        if rows:
            parts.append(Picture(title, _named(rows), f"Where an oracle sees the effect at {CLEAR} sigma or more."))
            parts.append(_effects(title, rows))
        if groups := by_label(scores, name):
            parts.append(_cases(f"{title}, case by case", groups))
    lead = (
        "In the cell field the amount of each effect is drawn, and its strength beside the others follows; a recording "
        f"also holds effects below {CLEAR} sigma, which need not be named. A second recording of the same thruster is "
        "asked against the twin of the first."
    )
    return Section("Composites and differences", tuple(parts), lead) if parts else None


def _named(rows: Sequence[Mapping[str, Any]]) -> Plot:
    shown = [
        Row(r["effect"], (Rate(r["named"], r["clear"]), Rate(r["named"] + r["among_rivals"], r["clear"]))) for r in rows
    ]
    return figures.rates(shown, ("named", "or among stated rivals"), "of the effects that are there / %", 0.9)


def _effects(title: str, rows: Sequence[Mapping[str, Any]]) -> Table:
    head = (
        "effect",
        f"at {CLEAR} sigma or more",
        "named",
        "among rivals",
        "below it",
        "named",
        "named where it is not",
        "said where it was missed",
    )
    cells = tuple(
        (
            r["effect"],
            str(r["clear"]),
            str(r["named"]),
            str(r["among_rivals"]),
            str(r["runs"] - r["clear"]),
            str(r["faint_named"]),
            str(r["named_where_not_there"]),
            counts(r["said_where_missed"]),
        )
        for r in rows
    )
    return Table(f"{title}, effect by effect", head, cells, frozenset({0, 7}), folded=True)


def _cases(title: str, groups: Mapping[str, Sequence[Score]]) -> Table:
    head = ("cases", "as they should be", "a name that is not there", "unexplained", "said instead")
    cells = tuple(
        (
            label.replace("_", " "),
            rate(s.good for s in group).told,
            rate(s.extra for s in group).told,
            rate(s.said == "unexplained" for s in group).told,
            instead([s for s in group if not s.good]),
        )
        for label, group in groups.items()
    )
    return Table(title, head, cells, frozenset({0, 4}))
