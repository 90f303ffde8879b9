"""The page of `rig prove`: goals and figures side by side, then each of them in full, then the worst cells."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from rig.blind.beside import Beside
from rig.blind.collecting import Collected
from rig.blind.design import STRENGTHS
from rig.blind.report import figures
from rig.blind.report.beside import peers_section, real_section
from rig.blind.report.composites import composites_section
from rig.blind.report.figures import Row
from rig.blind.report.sections import SIGNS, alarms_section, models_section, open_section, power_section
from rig.blind.scoring.metrics import besides, by_label, cell, goals
from rig.blind.scoring.rates import Goal, rate
from rig.blind.scoring.score import AS_RIVAL, Score
from rig.blind.scoring.tables import confusion, counts, instead
from rig.report.page import Page, Picture, Remark, Section, Sentences, Table

UNNAMED = (AS_RIVAL, "unexplained", "adequate", "failed")
FEW = 8
"""Rows of a table that is shown without being asked for."""
MOST_SAID = 4
"""Cases told of one cell in the list of the worst."""


def proof_page(found: Collected, tables: dict[str, Any], beside: Sequence[Beside] = ()) -> Page:
    """`tables`: of rig.blind.scoring.tables; `beside`: what others find."""
    scores, told = found.scores, goals(found.scores)
    parts = [
        _goals(told, besides(scores)),
        _alone(scores),
        _taken(scores),
        _other_cells(scores),
        composites_section(scores, tables),
        open_section(tables),
        alarms_section(scores),
        models_section(scores, tables),
        power_section(scores, tables),
        peers_section(beside, found.versions),
        real_section(beside, found.versions),
        _worst(tables),
        _made(found, tables),
    ]
    return Page(
        "Blind proof of the diagnosis", _lead(found, told), tuple(p for p in parts if p is not None), contents=True
    )


def _lead(found: Collected, told: Sequence[Goal]) -> str:
    sums = {sign: sum(g.met == sign for g in told) for sign in SIGNS}
    unmeasured = sum(not g.n for g in told)
    more = f", {unmeasured} not measured" if unmeasured else ""
    mixed = f" By {len(found.versions)} versions of the diagnosis." if len(found.versions) > 1 else ""
    return (
        f"{len(found.scores)} diagnoses of recordings with concealed physics: {sums['yes']} goals met, "
        f"{sums['reached']} reached, {sums['open']} open, {sums['no']} missed{more}.{mixed}"
    )


def _goals(told: Sequence[Goal], more: Sequence[Goal]) -> Section:
    head = ("figure", "goal", "measured", "95 % interval", "n", "")
    rows = tuple((g.what, g.wanted, g.measured, g.interval, str(g.n), SIGNS.get(g.met, "")) for g in told)
    others = tuple((g.what, g.measured, g.interval, str(g.n)) for g in more)
    lead = (
        "Met: the whole interval lies within the goal. Reached: the figure does, its interval does not. Open: the "
        "interval touches the goal, the figure does not reach it. Missed: all of it lies outside."
    )
    tables = (
        Table("Goals and what was measured", head, rows, frozenset({0, 1, 5})),
        Table("Beside the goals", ("figure", "measured", "95 % interval", "n"), others, frozenset({0})),
    )
    return Section("Goals", tables, lead)


def _alone(scores: Sequence[Score]) -> Section | None:
    effects = by_label(scores, *STRENGTHS)
    if not effects:
        return None
    rows = [
        Row(e, tuple(rate(s.right for s in cell(group, name)) for name in STRENGTHS)) for e, group in effects.items()
    ]
    series = [f"{name} ({d:g} sigma)" for name, d in STRENGTHS.items()]
    plot = figures.rates(rows, series, "right or among stated rivals / %")
    head = ("effect", *(f"{name}: {what}" for name in STRENGTHS for what in ("right", "alone")), "wrong names")
    cells = tuple(
        (
            e,
            *(
                r.told
                for n in STRENGTHS
                for r in (rate(s.right for s in cell(g, n)), rate(s.alone for s in cell(g, n)))
            ),
            rate(s.wrong for s in g).told,
        )
        for e, g in effects.items()
    )
    table = Table("Each effect by itself", head, cells, folded=True)
    lead = "Strength is d', the sigma at which an oracle sees the effect that knows it, its shape and the noise."
    picture = Picture("Effects by themselves", plot, "Bars are 95 % intervals (Wilson).")
    return Section("One effect", (picture, table), lead)


def _taken(scores: Sequence[Score]) -> Section | None:
    parts = []
    for name, d in STRENGTHS.items():
        counts = confusion(scores, name)
        if counts:
            title = f"What was answered, {name} ({d:g} sigma)"
            parts.append(
                Picture(
                    title,
                    figures.taken_for(counts, UNNAMED),
                    "One row for each effect that was concealed; the area of a mark is its share of the answers.",
                )
            )
    return Section("What was taken for what", tuple(parts)) if parts else None


def _other_cells(scores: Sequence[Score]) -> Section | None:
    head = ("concealed", "right", "alone", "wrong names", "said instead")
    parts = []
    for name, caption in (
        ("variant", "Textbook forms that the catalogue has in other words, at plain strength"),
        ("form", "Textbook forms of the catalogue at plain strength"),
        ("fault", "Channels that lie"),
        ("pair", "Pairs"),
    ):
        groups = by_label(scores, name)
        if name == "pair":
            groups = {"two effects at random": cell(scores, name)} if groups else {}
        rows = tuple(
            (
                label.replace(":", ", "),
                rate(s.right for s in group).told,
                rate(s.alone for s in group).told,
                rate(s.wrong for s in group).told,
                instead(group),
            )
            for label, group in groups.items()
        )
        if rows:
            parts.append(Table(caption, head, rows, frozenset({0, 4}), folded=len(rows) > FEW))
    return Section("Forms, faults and pairs", tuple(parts)) if parts else None


def _worst(tables: dict[str, Any]) -> Section | None:
    head = ("case", "failures", "what was said")
    cells = tuple(
        (
            f"{row['cell']}: {row['label']}",
            f"{row['failures']} of {row['n']}",
            "; ".join(map(_short, row["said"][:MOST_SAID])),
        )
        for row in tables["worst"]
    )
    if not cells:
        return None
    how = Sentences(("One case anew, with truth and answer: rig prove --case plain/heating/3",))
    return Section("Worst cells", (how, Table("Cells with the most failures", head, cells, frozenset({0, 2}))))


def _short(said: dict[str, Any]) -> str:
    number = said["id"].rsplit("/", 1)[1]
    place = f" at {said['place']}" if said["place"] else ""
    truth = f" of {' + '.join(said['truth'])}" if len(said["truth"]) > 1 else ""
    return f"#{number}{truth}: {said['verdict'][:60]}{place} {' + '.join(said['named'])}".strip()


def _made(found: Collected, tables: dict[str, Any]) -> Section:
    seconds = tables["seconds"]
    failed = [f"{s['id']}: {s['verdict'][:200]}" for s in tables["failed"]]
    several = len(found.versions) > 1
    rows: list[str | Remark] = [
        "The world's process wrote recordings and, apart from them, the sealed truth; the diagnosis ran in a process "
        "that cannot open the seals.",
        _which(tables["draw"]),
        f"{found.missing} orders are not answered yet; {_not_drawn(found.undrawn)}",
        f"One diagnosis takes {seconds['0.5']:.1f} s (median), {seconds['0.95']:.1f} s (95 %), "
        f"{seconds['1.0']:.0f} s at most.",
        Remark(
            f"Versions of the diagnosis that answered: {', '.join(found.versions) or 'none'}"
            + ("; --renew answers all with the present one." if several else "."),
            "doubt" if several else "",
        ),
        *(Remark(text, "bad") for text in failed[:20]),
    ]
    if len(failed) > 20:
        rows.append(Remark(f"and {len(failed) - 20} more that crashed, refused or took too long", "bad"))
    return Section("How it was made", (Sentences(tuple(rows)),))


def _which(draw: str) -> str:
    if draw:
        return f"The cases are those of draw {draw}."
    return "The cases are those that the diagnosis was developed on: figures of a draw of its own are the fairer ones."


def _not_drawn(undrawn: Sequence[str]) -> str:
    if not undrawn:
        return "every case could be drawn."
    cells = Counter(case.split(": ")[0].rsplit("/", 1)[0] for case in undrawn)
    return (
        f"{len(undrawn)} cases could not be drawn, for no plan, scale and noise of a load cell shows that effect at "
        f"that strength: {counts(dict(cells.most_common()))}."
    )
