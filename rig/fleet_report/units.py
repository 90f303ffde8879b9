"""Thrusters of a fleet in order: of each recording one row, by serial number and time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rig.fleet.question import Row


@dataclass(frozen=True)
class Units:
    """`rows` in order; `without`: rows of recordings that could not be fitted; `aside`: rows that were asked
    otherwise than most, by what they were asked; `twice`: rows of a recording that another row is of."""

    rows: tuple[Row, ...]
    without: tuple[Row, ...]
    aside: dict[str, int]
    twice: int


def units_of(rows: Iterable[Row]) -> Units:
    """In the order of their serial numbers, of one number in that of time; those without one after them, by name.

    Of a recording that is there twice (copied by `rig recover` or `rig pack`) the row of the file that was closed in
    order counts. Of several ways of asking the one that most recordings were asked.
    """
    found = list(rows)
    ways = Counter(row["asked"] for row in found if row["error"] is None)
    asked = min(ways, key=lambda way: (-ways[way], way)) if ways else ""
    options = {row["asked"]: row["options"] for row in found}
    ours = [row for row in found if row["asked"] == asked and row["error"] is None]
    single = _each_once(ours)
    single.sort(key=_order)
    without = tuple(sorted((row for row in found if row["error"] is not None), key=lambda row: str(row["url"])))
    aside = {options[way]: count for way, count in ways.items() if way != asked}
    return Units(tuple(single), without, aside, len(ours) - len(single))


def _each_once(rows: Sequence[Row]) -> list[Row]:
    found: dict[str, Row] = {}
    for row in sorted(rows, key=lambda row: (row["opened_as"] != "plain", row["url"])):
        found.setdefault(row["recording_id"] or row["sha256"], row)
    return list(found.values())


def _order(row: Row) -> tuple[bool, int, str, str, str]:
    serial = row["serial"]
    return serial is None, serial or 0, str(row["thruster"]), str(row["created"]), str(row["sha256"])
