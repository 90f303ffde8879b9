"""Sections of the page of `rig prove`: open world, clean recordings, models, detection power."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rig.blind.design import LADDER, ORACLE, WITHIN
from rig.blind.report import figures
from rig.blind.report.figures import Row
from rig.blind.scoring.metrics import by_label, named_by_strength, ratios
from rig.blind.scoring.rates import Rate, rate
from rig.blind.scoring.score import LOCATED, TELLABLE, Score
from rig.blind.scoring.tables import counts, instead
from rig.report.page import Picture, Section, Table

SIGNS = {"yes": "✓ met", "reached": "✓ reached", "open": "? open", "no": "✗ missed"}
OUTCOMES = (*LOCATED, "misplaced", "wrong name", "missed", "failed")


def open_section(tables: dict[str, Any]) -> Section | None:
    """The section on effects that the catalogue does not have; None where there were none."""
    rows = tables["open_world"]
    if not rows:
        return None
    parts: list[Picture | Table] = []
    for name, title in (
        ("outside", "Effects outside the catalogue"),
        ("removed", "Effects taken out of the catalogue"),
    ):
        bars = [(row["effect"], row["outcomes"]) for row in rows if row["cell"] == name and row["counted"]]
        if bars:
            parts.append(Picture(title, figures.outcomes(bars, OUTCOMES)))
    head = ("concealed", "can be told", *OUTCOMES, "names given", "places")
    cells = tuple(
        (
            row["effect"] + (", taken out" if row["cell"] == "removed" else ""),
            f"{row['counted']} of {row['runs']}",
            *(str(row["outcomes"].get(o, 0)) for o in OUTCOMES),
            counts(row["names"]),
            counts(row["places"]),
        )
        for row in rows
    )
    text = frozenset({0, 8, 9})
    parts.append(Table("What was said of physics that is not known", head, cells, text, folded=True))
    if tables["twins"]:
        parts.append(_twins(tables["twins"]))
    lead = (
        f"Counted where the best neighbour in the catalogue still leaves at least {TELLABLE:g} sigma to an oracle. "
        "Located: unexplained, with the right quantity; located, named: with a name beside it, wrong as every name is "
        "here. Wrong name: something is named, nothing said to be unexplained."
    )
    return Section("Open world", tuple(parts), lead)


def _twins(rows: Sequence[dict[str, Any]]) -> Table:
    head = ("effect", "twin", "runs", "sigma left", "said without it", "stated as rivals with it")
    cells = tuple(
        (
            row["effect"],
            row["twin"],
            str(row["runs"]),
            f"{row['left'][0]:g} to {row['left'][1]:g}" if row["left"][1] else "the rate is recorded",
            counts(row["said_instead"]),
            f"{row['rivals_stated']['hits']} of {row['rivals_stated']['n']}" if row["rivals_stated"]["n"] else "",
        )
        for row in rows
    )
    return Table(
        f"Twins: neighbours that leave less than {TELLABLE:g} sigma", head, cells, frozenset({0, 1, 4}), folded=True
    )


def alarms_section(scores: Sequence[Score]) -> Section | None:
    """The section on recordings that conceal nothing, by kind of noise; None where there were none."""
    groups = {**by_label(scores, "clean"), **by_label(scores, "wide")}
    if not groups:
        return None
    rows = [Row(kind, (rate(not s.right for s in group),)) for kind, group in groups.items()]
    plot = figures.rates(rows, ("alarms",), "false alarms / %", 0.01)
    head = ("noise", "alarms", "what was said")
    cells = tuple((kind, rate(not s.right for s in group).told, instead(group)) for kind, group in groups.items())
    picture = Picture("False alarms by kind of noise", plot, "Dashed: the stated 1 %.")
    return Section("Clean recordings", (picture, Table("Alarms", head, cells, frozenset({0, 2}))))


def models_section(scores: Sequence[Score], tables: dict[str, Any]) -> Section | None:
    """The section on how well the models found predict runs that nobody fitted; None where there were none."""
    model, baseline = ratios(scores, lambda h: h.model), ratios(scores, lambda h: h.baseline)
    parts: list[Picture | Table] = []
    if model.size:
        plot = figures.distribution(model, baseline, (1.05, 1.3))
        caption = (
            "A run of another plan, per sample, noise included. Dashed: the goals for half and for 95 % of the runs."
        )
        parts.append(Picture("Error in a run that was not seen", plot, caption))
        head = ("figure", "5 % of runs", "half", "95 %")
        names = {
            "model": "error of the model found / of the true model",
            "baseline": "error of the baseline / of the true model",
            "left": "model's own error / baseline's own error, without noise",
        }
        cells = tuple((text, *(f"{v:.3f}" for v in tables["held_out"][key].values())) for key, text in names.items())
        parts.append(Table("Held-out errors below which so many runs are", head, cells))
    if tables["coverage"]:
        columns = ("parameter", "intervals that hold the truth", "median z")
        cells = tuple(
            (f"{r['effect']}: {r['parameter']}", Rate(r["hits"], r["n"]).told, f"{r['median_z']:.2f}")
            for r in tables["coverage"]
        )
        parts.append(
            Table("95 % intervals of parameters that mean the same in world and catalogue", columns, cells, folded=True)
        )
    return Section("The models", tuple(parts)) if parts else None


def power_section(scores: Sequence[Score], tables: dict[str, Any]) -> Section | None:
    """The section on the strength at which each effect is named in half the runs; None where none is known."""
    by = named_by_strength(scores)
    if not tables["half_named"]:
        return None
    strengths = sorted({d for rates in by.values() for d in rates})
    pooled = {
        d: Rate(sum(r[d].hits for r in by.values() if d in r), sum(r[d].n for r in by.values() if d in r))
        for d in strengths
    }
    head = ("effect", "named in half the runs at", "times the oracle's", "", *(f"named at {d:.3g}" for d in strengths))
    cells = []
    for effect, d in tables["half_named"].items():
        within = d is not None and d <= WITHIN * ORACLE
        words = ("never", "") if d is None else (f"{d:.2f} sigma", f"{d / ORACLE:.2f}")
        cells.append(
            (
                effect,
                *words,
                SIGNS["yes" if within else "no"],
                *(by[effect].get(x, Rate(0, 0)).told for x in strengths),
            )
        )
    lead = (
        f"An oracle that knows the effect sees {ORACLE:.2f} sigma in half the runs at 1 % false alarms; the goal is "
        f"{WITHIN:g} times that. The weakest strength tried is {min(LADDER.values()):.3g}: what is named there in half "
        "the runs may be named below."
    )
    table = Table("The faintest strength", head, tuple(cells), frozenset({0, 3}), folded=True)
    return Section(
        "Detection power", (Picture("Named or among stated rivals", figures.power(pooled, ORACLE)), table), lead
    )
