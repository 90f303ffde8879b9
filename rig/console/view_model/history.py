"""The history page: what the catalogue has, newest first, as lines of a table that fit the screen. Pure."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import floor, log10
from typing import Any, Final, Literal

from rich.cells import cell_len, set_cell_size
from rich.text import Text

from rig.visible_text import visible


@dataclass(frozen=True, slots=True)
class Row:
    """A campaign, a recording, or a fit whose recordings are not there."""

    what: Literal["campaign", "recording", "fit"]
    path: str
    """Below the folder."""
    date: str
    thruster: str
    campaign: str
    outcome: str
    C: str
    verdict: str
    said: str
    told: Mapping[str, Any] = field(compare=False)
    """As the catalogue said it."""


@dataclass(frozen=True, slots=True)
class Rows:
    """All of them, and what of them is on the screen."""

    all: tuple[Row, ...] = ()
    cursor: int = 0
    top: int = 0
    """The first that is shown."""
    chosen: frozenset[int] = frozenset()
    """Places of those marked to be compared, one or two."""


Column = tuple[str, Callable[[Row], str]]
COLUMNS: Final[tuple[Column, ...]] = (
    ("began (UTC)", lambda row: row.date),
    ("thruster", lambda row: row.thruster),
    ("C ± U, k = 2", lambda row: row.C),
    ("verdict", lambda row: row.verdict),
    ("outcome", lambda row: row.outcome),
    ("file", lambda row: row.path),
    ("campaign", lambda row: row.campaign),
)
"""The most important first: those that find no room are left out from the end."""
MARKS: Final = 4
"""Columns before the table: the cursor, the choice, and the run that goes on."""
WIDEST: Final = 46
COMPARED: Final = ("recording", "fit")


def row_of(told: Mapping[str, Any]) -> Row:
    """Raises KeyError for what is no row."""
    texts = {name: visible(str(told[name])) for name in ("date", "thruster", "campaign", "outcome", "C", "verdict")}
    said = ". ".join(visible(str(told[name])) for name in ("said", "reason") if told[name])
    return Row(told["what"], visible(str(told["path"])), said=said, told=told, **texts)


def moved(rows: Rows, by: int, height: int) -> Rows:
    """With the cursor `by` rows further down, at most to an end, and in sight in `height` lines."""
    cursor = max(0, min(rows.cursor + by, len(rows.all) - 1))
    top = min(rows.top, cursor)
    return replace(rows, cursor=cursor, top=max(top, cursor - max(height, 1) + 1))


def toggled(rows: Rows) -> Rows:
    """With the row at the cursor chosen, or no longer; of three the newest two. A campaign can't be."""
    if not rows.all or rows.all[rows.cursor].what not in COMPARED:
        return rows
    if rows.cursor in rows.chosen:
        return replace(rows, chosen=rows.chosen - {rows.cursor})
    kept = rows.chosen if len(rows.chosen) < 2 else frozenset()
    return replace(rows, chosen=kept | {rows.cursor})


def to_compare(rows: Rows) -> tuple[Row, Row] | str:
    """The two chosen, or one and the one at the cursor, the older first; or what to do."""
    places = set(rows.chosen)
    if len(places) == 1 and rows.all[rows.cursor].what in COMPARED:
        places.add(rows.cursor)
    if len(places) != 2:
        return "Space marks a recording or fit; Enter compares it with the one at the cursor."
    newer, older = (rows.all[place] for place in sorted(places))
    if newer.thruster != older.thruster:
        return f"These are of {older.thruster or '?'} and {newer.thruster or '?'}: choose two of one thruster."
    return older, newer


def of_run(row: Row, running: Sequence[str]) -> bool:
    """Whether it is a recording of the present run, by the ends of its paths."""
    return any(row.path.endswith(name) for name in running)


def widths(rows: Sequence[Row], known: Sequence[int] = ()) -> tuple[int, ...]:
    """Of each column's widest text, in cells; `known`: of rows before these."""
    before = known or [cell_len(heading) for heading, _ in COLUMNS]
    told = [row for row in rows if row.what != "campaign"]
    return tuple(
        max([least, *(min(cell_len(of(row)), WIDEST) for row in told)])
        for least, (_, of) in zip(before, COLUMNS, strict=True)
    )


def shown_columns(wide: Sequence[int], width: int) -> int:
    """How many columns find room in `width` cells; a first one is always there."""
    count, used = 0, MARKS
    for each in wide:
        used += each + (2 if count else 0)
        if used > width and count:
            break
        count += 1
    return count


def history_text(rows: Rows, wide: Sequence[int], width: int, height: int, running: Sequence[str] = ()) -> Text:
    """The heading and `height` rows; `running`: ends of the paths of this run's recordings."""
    count = shown_columns(wide, width)
    text = Text(no_wrap=True, overflow="ellipsis")
    heading = "  ".join(set_cell_size(name, w) for (name, _), w in zip(COLUMNS[:count], wide, strict=False))
    text.append(f"{' ' * MARKS}{heading}".rstrip(), "bold")
    for place in range(rows.top, min(rows.top + height, len(rows.all))):
        row = rows.all[place]
        now = of_run(row, running)
        at = "reverse" if place == rows.cursor else ""
        marks = f"{'>' if place == rows.cursor else ' '}{'x' if place in rows.chosen else ' '}{'●' if now else ' '} "
        line = f"{marks}{_campaign(row) if row.what == 'campaign' else _line(row, wide[:count])}"
        text.append("\n").append(set_cell_size(line, width), f"{at} bold" if row.what == "campaign" else at)
    return text


def _line(row: Row, wide: Sequence[int]) -> str:
    return "  ".join(set_cell_size(of(row), w) for (_, of), w in zip(COLUMNS, wide, strict=False))


def _campaign(row: Row) -> str:
    return f"{row.date}  campaign {row.campaign}: {row.outcome}. {row.said}"


def compared_text(told: Mapping[str, Any]) -> Text:
    """`thruster-rig-fit-history` in words: the sentence, the two fits, the difference, what to know.

    Raises KeyError, TypeError or ValueError for what is none.
    """
    changed = bool(told["changed"])
    text = Text().append("≠ CHANGED" if changed else "= NOT CHANGED, as far as is seen", "bold")
    text.append(f"\n{visible(str(told['sentence']))}\n")
    for number, fit in enumerate(told["fits"], 1):
        text.append(f"\n{number}  {fit['began'] or 'no date'}  {visible(str(fit['source']))}\n")
        for name, p in fit["parameters"].items():
            digits = min(max(1 - floor(log10(p["expanded_k2"])), 0), 9) if p["expanded_k2"] > 0 else 6
            value, uncertainty = f"{p['value']:.{digits}f}", f"{p['expanded_k2']:.{digits}f}"
            text.append(f"   {name} = {value} ± {uncertainty} {visible(str(p['unit']))} (k = 2)\n")
    for pair in told["pairs"]:
        low, high = pair["relative_interval_95"]
        text.append(f"\n{pair['coefficient']}: {100 * pair['relative']:+.3f} % (95 %: {100 * low:+.3f} to ")
        text.append(f"{100 * high:+.3f} %), p = {pair['p_adjusted']:.2g}\n")
    for note in told["notes"]:
        text.append(f"\n- {visible(str(note))}")
    return text
