"""The diagnoses of the units that left their limits, against the twin of a usual one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rig.diagnose.fleet.row import COLUMNS, question_of
from rig.errors import RigError
from rig.fleet.asking import asked
from rig.fleet.elsewhere import is_url
from rig.fleet.options import Fleet
from rig.fleet.question import Row
from rig.fleet.store import Store
from rig.fleet_report.usual_twin import twin_of_usual


@dataclass(frozen=True)
class Diagnosed:
    """`by`: the answers by the SHA-256 of the recordings; `usual`: the unit whose twin they are told against."""

    by: Mapping[str, Row]
    usual: Row | None = None
    twin: Path | None = None
    why_not: str = ""
    """Nobody was diagnosed: a sentence; empty where nothing was to be."""

    def of(self, row: Row) -> str:
        """What a unit differs in from the usual one, as a sentence; empty where it was not diagnosed."""
        found = self.by.get(row["sha256"])
        if found is None:
            return ""
        return str(found["error"] or found["statement"])


def diagnosed(rows: Sequence[Row], usual: Row, store: Store, fleet: Fleet, seed: int) -> Diagnosed:
    """Of these rows' recordings, kept in the store as those of `rig diagnose --jobs` are.

    Where no recording of the usual unit is to be had the sentence says so: the charts stand without any diagnosis.
    """
    places = store.places()

    def where(row: Row) -> str:
        return places.get(row["sha256"]) or str(row["url"])

    try:
        twin = twin_of_usual(where(usual), usual["thruster"], store.root, seed)
    except (RigError, OSError) as error:
        return Diagnosed({}, why_not=f"the usual unit, {usual['thruster']}, could not be diagnosed: {error}")
    question = question_of(seed, twin, any_thruster=True)
    there = [url for url in map(where, rows) if is_url(url) or Path(url).is_file()]
    asked(question, COLUMNS, there, store, fleet)
    wanted = {row["sha256"] for row in rows}
    known = [row for row in store.rows_of(question.table) if row["asked"] == question.asked]
    return Diagnosed({row["sha256"]: row for row in known if row["sha256"] in wanted}, usual, twin)
