"""From files, ids or a thruster's name to fits with their times: read where they are fits, fitted on the way else."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

from identification.thruster.thrust_forms import FORMS, Model
from rig.catalogue.asking import Place, with_catalogue
from rig.catalogue.entry import UNREADABLE, Entry
from rig.catalogue.fit_history import DatedFit, History, history
from rig.catalogue.selection import Filter, named, related, selected
from rig.errors import ConfigError, RecordingError
from rig.fit.answer import FIT_FORMAT, Answer, fit_files
from rig.fit.as_json import answer_json
from rig.fit.comparison import group_of_json, of_model, read_fit, repeats

WHAT_IT_HOLDS: Final = "what it holds was used"
"""In the note of a fit to a recording that was aborted or tripped."""


class Wanted(NamedTuple):
    """Which fit of each is compared. `thruster`: empty where all that is given is of one."""

    thruster: str = ""
    model: Model = "C V|V|"
    against: str = "command_voltage"

    @property
    def name(self) -> str:
        """Of the model, as a fit has it: by the rotation rate it has another."""
        return FORMS[self.model, self.against == "rotation_rate"].name


@dataclass(frozen=True, slots=True)
class Source:
    """What becomes one fit: recordings, or the JSON of a fit."""

    name: str
    began: float | None
    recordings: tuple[Path, ...] = ()
    document: Path | None = None
    thrusters: tuple[str, ...] = ()


@dataclass(slots=True)
class Fitted:
    """What was made of the sources so far."""

    fits: list[DatedFit] = field(default_factory=list)
    answers: list[Answer] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    seen: dict[str, str] = field(default_factory=dict)
    """Recording -> source that it went into."""


def sources_named(items: Iterable[str], folder: Path | None, cache: Path) -> list[Source]:
    """One for each file or id. Raises ConfigError for what is neither a recording nor a fit."""
    return [_named(item, folder, cache) for item in items]


def _named(item: str, folder: Path | None, cache: Path) -> Source:
    place = Place.of(item, folder)
    entries = with_catalogue(place.folder, cache, lambda connection: named(connection, item, place.path))
    usable = [each for each in entries if each.what in ("recordings", "fits")]
    if not usable:
        raise ConfigError(f"{item} is one of the {entries[0].what}; expected recordings or JSON of `rig fit --json`")
    return _source(usable, place.folder.resolve())


def _source(entries: Sequence[Entry], folder: Path) -> Source:
    """Of the entries of one file, or of the recordings of one campaign. Raises RecordingError for a damaged one."""
    first = entries[0]
    if first.outcome == UNREADABLE:
        raise RecordingError(f"{folder / first.path}: {first.reason}")
    thrusters = tuple(dict.fromkeys(each.thruster for each in entries))
    if first.what == "fits":
        return Source(first.path, first.began, document=folder / first.path, thrusters=thrusters)
    paths = {each.id or each.path: folder / each.path for each in entries}
    return Source(first.path, first.began, recordings=tuple(paths.values()), thrusters=thrusters)


def sources_of(folder: Path, cache: Path, wanted: Filter) -> list[Source]:
    """A thruster's recordings, those of one campaign together; and fits of recordings that are not there."""

    def work(connection: sqlite3.Connection) -> list[Source]:
        recordings = [each for each in selected(connection, wanted) if each.kind != "vehicle"]
        groups: dict[tuple[str, str], list[Entry]] = {}
        for each in recordings:
            alone = each.path if not each.campaign else ""
            groups.setdefault((str(Path(each.path).parent / alone), each.campaign), []).append(each)
        fits = selected(connection, replace(wanted, what="fits"))
        orphans = [each for each in fits if not related(connection, each)]
        return [_source(group, folder.resolve()) for group in (*groups.values(), *([each] for each in orphans))]

    return with_catalogue(folder, cache, work)


def compared(sources: Sequence[Source], wanted: Wanted) -> History:
    """The fits of one thruster beside one another. Raises ConfigError where they are not of one."""
    wanted = wanted._replace(thruster=wanted.thruster or _common(sources))
    done = Fitted()
    for source in sources:
        try:
            _add(done, source, wanted)
        except RecordingError as error:
            done.remarks.append(f"left out: {source.name}: {error}")
    return history(wanted.thruster, wanted.name, done.fits, repeats(done.answers), done.remarks)


def _common(sources: Sequence[Source]) -> str:
    """The thruster that all are of."""
    common = set.intersection(*(set(source.thrusters) for source in sources)) if sources else set()
    if len(common) != 1:
        told = "; ".join(f"{source.name}: {', '.join(source.thrusters) or 'none'}" for source in sources[:5])
        raise ConfigError(f"which thruster? These are not all of one and the same ({told}); give --thruster")
    return common.pop()


def _add(done: Fitted, source: Source, wanted: Wanted) -> None:
    """Raises RecordingError for what allows no fit."""
    answers = fit_files(source.recordings, wanted.model, wanted.against) if source.document is None else ()
    document = answer_json(answers) if source.document is None else read_fit(source.document)
    entry = _entry(document, wanted)
    twice = next((name for name in entry["recordings"] if name in done.seen), None)
    if twice is not None:
        raise RecordingError(f"recording {twice} is in {done.seen[twice]} too, and is counted once")
    if entry.get("voltage", wanted.against) != wanted.against:
        raise RecordingError(f"fitted over {entry['voltage']}, the others over {wanted.against}")
    done.seen |= dict.fromkeys(entry["recordings"], source.name)
    done.fits.append(DatedFit(source.name, source.began, entry))
    done.answers += answers
    done.remarks += [note for answer in answers for note in answer.notes if WHAT_IT_HOLDS in note]


def _entry(document: Mapping[str, Any], wanted: Wanted) -> Mapping[str, Any]:
    """The one of the thruster and model, with all that is asked of it. Raises RecordingError."""
    try:
        entries = [each for each in document["fits"] if each["thruster"] == wanted.thruster]
        found = of_model(entries, wanted.name)
        if found is not None:
            group_of_json(found, wanted.thruster)
            facts = [(p["value"], p["std"], p["unit"]) for p in found["parameters"].values()]
            found = {"recordings": entries[0]["recordings"], "rmse": None, **found} if facts else None
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise RecordingError(f"a fit in it is not as {FIT_FORMAT} has it ({error!r})") from error
    if found is None:
        raise RecordingError(f"has no {wanted.name} of {wanted.thruster or 'a thruster without a name'}")
    return found
