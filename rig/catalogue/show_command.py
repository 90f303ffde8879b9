"""`rig show ID-OR-FILE`: all that is known of one recording, campaign, fit, twin, diagnosis or calibration."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import click

from rig.catalogue.asking import CACHE, JSON, Place, aligned, entry_json, spent, tell, with_catalogue
from rig.catalogue.entry import ONE, UNREADABLE, Entry, date_of
from rig.catalogue.selection import named, related

MOST: Final = 20
"""Lines of one kind that are shown; the JSON has all."""
LINES: Final = {
    "thruster": "thruster",
    "kind": "kind",
    "campaign": "campaign",
    "outcome": "outcome",
    "operator": "operator",
    "bench": "bench",
    "said": "in short",
    "reason": "why",
}
"""Field of an entry -> how it is called."""
ATTRIBUTES: Final = ("facility", "notes", "software", "attempt", "continues")
"""Of a recording, shown where it has them."""


@dataclass(frozen=True, slots=True)
class Shown:
    """One thing, with what belongs to it."""

    entries: tuple[Entry, ...]
    """Of one id or file: several where a file has several fits, or a recording lies there twice."""
    related: tuple[Entry, ...]
    header: Mapping[str, Any] | None = None
    """Of a recording that can be read."""

    @property
    def first(self) -> Entry:
        """What was asked for; of a file with a recording the recording."""
        return next((each for each in self.entries if each.what == "recordings"), self.entries[0])


@click.command("show")
@click.argument("what", metavar="ID-OR-FILE")
@click.argument("folder", type=click.Path(path_type=Path), required=False)
@JSON
@CACHE
def show_command(what: str, folder: Path | None, json_path: Path | None, cache: Path) -> None:
    """Show a recording, campaign, fit, twin, diagnosis or calibration of FOLDER, here when not given.

    The beginning of an id is enough. A file that is not in FOLDER is shown with what lies beside it.
    """
    place = Place.of(what, folder)

    def work(connection: sqlite3.Connection) -> Shown:
        entries = named(connection, what, place.path)
        return Shown(tuple(entries), tuple(_others(connection, entries)))

    found = with_catalogue(place.folder, cache, work)
    if found.first.what == "recordings" and found.first.outcome != UNREADABLE:
        found = Shown(found.entries, found.related, header_of(place.folder.resolve() / found.first.path))
    tell(json_path, lambda: show_json(found), lambda: show_text(found))


def _others(connection: sqlite3.Connection, entries: Iterable[Entry]) -> Iterator[Entry]:
    seen = set()
    for entry in entries:
        if entry.what == "calibrations" and any(each.what == "recordings" for each in entries):
            continue
        for each in related(connection, entry):
            if (key := (each.what, each.path, each.id, each.thruster)) not in seen:
                seen.add(key)
                yield each


def header_of(path: Path) -> dict[str, Any]:
    """Channels with rates, steps and events of a recording, as JSON has them. Raises RecordingError."""
    from rig.hdf5 import headers, load

    recording, (header,) = load(path, rows=0), headers([path])
    rates = {} if isinstance(header, Exception) else {s.name: (s.rows, _rate(s)) for s in header.streams}
    channels = []
    for each in recording.channels:
        rows, rate = rates.get(each.stream, (None, None))
        channels.append(
            {
                "stream": each.stream,
                "channel": each.name,
                "quantity": each.quantity,
                "unit": each.unit,
                "rows": rows,
                "rate": rate,
                "calibration": dict(each.calibration) or None,
            }
        )
    known = {name: recording.attributes[name] for name in ATTRIBUTES if name in recording.attributes}
    return {
        "channels": channels,
        "steps": len(recording.steps),
        "events": [{"time": e.time, "level": e.level, "text": e.text} for e in recording.events],
        "attributes": {name: str(value) for name, value in known.items()},
        "complete": recording.complete,
        "water_density": recording.water_density,
    }


def _rate(stream: Any) -> float | None:
    """Rows per s; None for fewer than two."""
    length = None if stream.first is None or stream.last is None else stream.last - stream.first
    return (stream.rows - 1) / length if length else None


def show_json(found: Shown) -> dict[str, Any]:
    """`thruster-rig-show` version 1."""
    return {
        "format": "thruster-rig-show",
        "version": 1,
        "entries": [entry_json(each) for each in found.entries],
        "related": [entry_json(each) for each in found.related],
        "recording": None if found.header is None else dict(found.header),
    }


def show_text(found: Shown) -> str:
    """What a person reads."""
    first = found.first
    lines = [f"{ONE[first.what]} {first.id or first.path}", *_facts(first)]
    same = [each for each in found.entries if each is not first and each.what == first.what]
    if first.what in ("fits", "campaigns") or not same:
        lines += [line for each in same for line in ("", *_facts(each))]
    elif first.what == "recordings":
        lines += [f"  also at    {each.path}" for each in same]
    if found.header is not None:
        lines += _header(found.header)
    lines += [line for run in first.facts.get("runs", ()) for line in _run(run)]
    for what in dict.fromkeys(each.what for each in found.related):
        lines += ["", *_related(what, [each for each in found.related if each.what == what])]
    return "\n".join(lines)


def _facts(entry: Entry) -> Iterator[str]:
    yield f"  {'file':<10} {entry.path}"
    if entry.began is not None:
        yield f"  {'began':<10} {date_of(entry.began, 'seconds')} UTC" + (
            "" if entry.stated else ", by its recordings or the date of its file"
        )
    if entry.duration is not None:
        yield f"  {'duration':<10} {spent(entry.duration)}"
    for name, title in LINES.items():
        if text := getattr(entry, name):
            yield f"  {title:<10} {' '.join(text.split())}"
    if entry.what == "calibrations":
        yield f"  {'text':<10} {entry.facts.get('calibration', '')}"
    if statement := entry.facts.get("statement"):
        yield f"  {'statement':<10} {' '.join(statement.split())}"


def _header(header: Mapping[str, Any]) -> Iterator[str]:
    for name, value in header["attributes"].items():
        yield f"  {name:<10} {' '.join(value.split())}"
    rows = [("stream", "channel", "quantity", "unit", "rate", "rows")]
    for each in header["channels"]:
        rate = "" if each["rate"] is None or each["stream"] == "command" else f"{each['rate']:.4g} Hz"
        rows.append((each["stream"], each["channel"], each["quantity"] or "", each["unit"], rate, str(each["rows"])))
    yield from ("", *(f"  {line}" for line in aligned(rows)))
    for each in header["channels"]:
        if each["calibration"] and each["quantity"] == "thrust":
            facts = ", ".join(f"{key} {value}" for key, value in each["calibration"].items())
            yield f"  calibration of {each['stream']}/{each['channel']}: {facts}"
    noted = [event for event in header["events"] if event["level"] != "info"]
    yield ""
    yield f"  {header['steps']} steps, {len(header['events'])} events" + (", of note:" if noted else "")
    yield from (
        f"  {event['time']:>9.2f} s  {event['level']:<8} {' '.join(event['text'].split())}" for event in noted[:MOST]
    )
    yield from _more(len(noted))


def _run(run: Mapping[str, Any]) -> Iterator[str]:
    yield f"  run        {run['thruster']}: {run['outcome']}, {run['recording']}"


def _related(what: str, entries: Sequence[Entry]) -> Iterator[str]:
    yield f"  {what} of it:" if what != "recordings" else "  of the recordings:"
    rows = [("began", "id", "thruster", "outcome", "said", "file")]
    for each in entries[-MOST:]:
        said = each.said if what != "recordings" else spent(each.duration)
        rows.append(
            (
                date_of(each.began),
                each.id[:8] if what != "campaigns" else each.id,
                each.thruster,
                each.outcome,
                said,
                each.path,
            )
        )
    yield from (f"    {line}" for line in aligned(rows, 60)[1:])
    yield from _more(len(entries))


def _more(count: int) -> Iterator[str]:
    if count > MOST:
        yield f"    and {count - MOST} more: --json has all"
