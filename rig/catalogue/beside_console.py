"""`python -m rig.catalogue.beside_console`: the catalogue for the console that started it, a line of JSON each.

Standard input has one line of JSON with what is asked:

- `{"folder": PATH, "refresh": BOOL}`: what the folder has. `{"at": TEXT}` says how far the index is, `{"rows": [ROW]}`
  has some of it, newest first, and `{"end": TEXT}` closes it. Without `refresh` no file is read but the index.
- `{"folder": PATH, "compare": [ROW, ROW]}`: has this thruster changed? `{"compared": thruster-rig-fit-history}`.

`{"fault": TEXT}` is why there is no answer. It has the least priority, and ends when standard input does: the
console is gone.
"""

from __future__ import annotations

import json
import os
import sqlite3
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from math import floor, log10
from pathlib import Path
from typing import Any, Final

from rig.catalogue.entry import UNREADABLE, Entry, date_of
from rig.catalogue.index import places, with_index
from rig.catalogue.refresh import refresh
from rig.catalogue.selection import Filter, recordings_of, selected
from rig.errors import ConfigError, RigError

CHUNK: Final = 100
"""Rows in one line: what the console reads between two turns of its screen."""
MISFIT_P: Final = 1e-3
"""As in the table at the end of a campaign."""
LEAST: Final = 19
"""Steps of niceness: whatever else wants a processor goes first."""
CACHE: Final = "XDG_CACHE_HOME"

Say = Callable[[dict[str, Any]], None]
Row = dict[str, Any]


def history(folder: Path, cache: Path, say: Say, *, fresh: bool) -> None:
    """Say what `folder` has, newest first. Raises RigError."""
    if not folder.is_dir():
        raise ConfigError(f"there is no folder {folder}")
    if not fresh and not any(place.exists() for place in places(folder, cache)):
        raise ConfigError(f"{folder} has no index yet; it is made once nothing turns, here with u or by `rig list`")

    def work(connection: sqlite3.Connection) -> list[Row]:
        if fresh:
            refresh(connection, folder, lambda done, of: say({"at": f"{done} of {of} files read"}))
        plain = (selected(connection, Filter(what), facts=False) for what in ("recordings", "campaigns"))
        return rows(*plain, *(_with_recordings(connection, what) for what in ("fits", "diagnoses")))

    left = iter(with_index(folder, cache, work, lambda text: say({"at": text})))
    count = 0
    while chunk := list(islice(left, CHUNK)):
        count += sum(row["what"] == "recording" for row in chunk)
        say({"rows": chunk})
    say({"end": f"{count} recording{'' if count == 1 else 's'}{'' if fresh else ', as the index had them'}"})


def _with_recordings(connection: sqlite3.Connection, what: str) -> list[Entry]:
    of = recordings_of(connection, what)
    found = selected(connection, Filter(what))
    return [replace(each, recordings=of.get((each.path, each.thruster), ())) for each in found]


def rows(
    recordings: Sequence[Entry], campaigns: Sequence[Entry], fits: Sequence[Entry], diagnoses: Sequence[Entry]
) -> list[Row]:
    """Campaigns, each above its recordings, and recordings and fits of none; all newest first."""
    known = {each.id for each in recordings}
    fit_of = {identity: fit for fit in fits for identity in fit.recordings}
    verdict_of = {identity: each.outcome for each in diagnoses for identity in each.recordings}
    of_folder = {str(Path(each.path).parent): each for each in campaigns}
    groups: dict[str, list[Row]] = {}
    for each in recordings:
        parent = str(Path(each.path).parent)
        row = _row("recording", each, fit_of.get(each.id), verdict_of.get(each.id, ""))
        groups.setdefault(parent if parent in of_folder else each.path, []).append(row)
    for each in fits:
        if not known.intersection(each.recordings):
            groups[f"{each.path}: {each.thruster}"] = [_row("fit", each, each, "")]
    for name in of_folder.keys() - groups.keys():
        groups[name] = []
    for name, found in groups.items():
        found.sort(key=_time, reverse=True)
        if name in of_folder:
            found.insert(0, _row("campaign", of_folder[name], None, ""))
    ordered = sorted(groups.values(), key=lambda group: max(map(_time, group)), reverse=True)
    return [row for group in ordered for row in group]


def _time(row: Row) -> float:
    return float("-inf") if row["began"] is None else float(row["began"])


def _row(what: str, entry: Entry, fit: Entry | None, diagnosis: str) -> Row:
    unreadable = entry.outcome == UNREADABLE
    return {
        "what": what,
        "path": entry.path.encode("utf-8", "backslashreplace").decode(),
        "id": entry.id,
        "began": entry.began,
        "date": date_of(entry.began),
        "thruster": entry.thruster,
        "campaign": entry.campaign,
        "outcome": entry.outcome,
        "C": "" if fit is None else constant(fit.facts.get("parameters", {})),
        "verdict": "" if unreadable else _verdict(fit, diagnosis),
        "said": entry.said if what == "campaign" else "",
        "reason": entry.reason,
    }


def constant(parameters: Mapping[str, Any]) -> str:
    """The first parameter with its expanded uncertainty, k = 2.

    >>> constant({"C": {"value": 0.401932, "std": 0.000233, "unit": "N/V^2"}})
    '0.40193 ± 0.00047'
    >>> constant({"a": {"value": 1.5, "std": 0.01, "unit": "N"}}), constant({})
    ('a 1.500 ± 0.020', '')
    """
    name, first = next(iter(parameters.items()), ("", None))
    if first is None:
        return ""
    value, std = first["value"], first["std"]
    if value is None or not std:
        return "not determined"
    digits = min(max(1 - floor(log10(2 * std)), 0), 9)
    return f"{'' if name == 'C' else f'{name} '}{value:.{digits}f} ± {2 * std:.{digits}f}"


def _verdict(fit: Entry | None, diagnosis: str) -> str:
    """Of the newest diagnosis; else whether the fit suits its points; if not, with its chi2/dof."""
    p = None if fit is None else fit.facts.get("chi2_p")
    if diagnosis or fit is None or p is None:
        return diagnosis
    return f"does NOT fit, {fit.facts['chi2_per_dof']:.3g}" if p < MISFIT_P else "fits"


def compare(folder: Path, chosen: Sequence[Row]) -> dict[str, Any]:
    """The sentence and figures of `rig compare-fits`. Raises RigError."""
    from rig.catalogue.compare_fits import history_json
    from rig.catalogue.fits_to_compare import Source, Wanted, compared

    def source(row: Row) -> Source:
        path, thrusters = folder / row["path"], (row["thruster"],)
        if row["what"] == "recording":
            return Source(row["path"], row["began"], recordings=(path,), thrusters=thrusters)
        return Source(row["path"], row["began"], document=path, thrusters=thrusters)

    found = compared([source(row) for row in chosen], Wanted())
    if len(found.fits) < 2:
        raise ConfigError("; ".join(found.remarks) or "two fits are needed")
    return history_json(found)


def answer(asked: Mapping[str, Any], say: Say) -> None:
    """Say what is asked, or why not."""
    folder = Path(asked["folder"])
    cache = Path(os.environ.get(CACHE) or "~/.cache").expanduser()
    try:
        if "compare" in asked:
            say({"compared": compare(folder, asked["compare"])})
        else:
            history(folder.resolve(), cache, say, fresh=asked["refresh"])
    except (RigError, OSError, sqlite3.Error) as error:
        say({"fault": str(error)})


def end_with_input() -> None:
    """From now on this process ends as soon as standard input does."""

    def wait() -> None:
        while os.read(0, 4096):
            pass
        os._exit(1)

    threading.Thread(target=wait, name="end of input", daemon=True).start()


def main() -> None:
    """Of the line on standard input."""
    os.nice(LEAST)
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what a library prints is none of our lines
    asked = json.loads(sys.stdin.readline())
    end_with_input()

    def say(message: dict[str, Any]) -> None:
        out.write(json.dumps(message, allow_nan=False) + "\n")
        out.flush()

    answer(asked, say)


if __name__ == "__main__":
    main()
