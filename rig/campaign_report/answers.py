"""What fit and diagnosis say of each thruster of a campaign, and what the earlier campaigns beside it say."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Final

from identification.recording import Recording
from rig.campaign_report.folder import Campaign, Run
from rig.errors import RecordingError
from rig.fit.answer import Answer, fit_recordings, is_driven
from rig.fit.comparison import Changed, changed

if TYPE_CHECKING:
    from identification.mismatch.diagnosis import Diagnosis
    from identification.mismatch.observer import Observer

FIT_FILE: Final = "fits.json"
"""What a campaign's end leaves in its folder for the next ones to be compared with."""
MOST_EARLIER: Final = 3
"""Campaigns of the same output folder that are compared with by themselves, newest first."""
_STAMP: Final = re.compile(r"-(\d{8}-\d{6})$")
"""Date and time at the end of a campaign folder's name, as `rig run` makes it."""


@dataclass(frozen=True, eq=False)
class Told:
    """Of one thruster: its runs, the fit of what they hold, the diagnosis; where one lacks, the sentence why."""

    thruster: str
    runs: tuple[Run, ...]
    answer: Answer | None
    why_no_fit: str = ""
    diagnosis: Diagnosis | None = None
    why_no_diagnosis: str = ""
    cut_short: bool = False
    """The search of the diagnosis was ended with what it had: its verdict is not its last word."""

    @property
    def recordings(self) -> tuple[Recording, ...]:
        """Those that the fit is of."""
        return tuple(run.recording for run in self.runs if run.recording is not None and is_driven(run.recording))

    @property
    def paths(self) -> tuple[Path, ...]:
        return tuple(run.path for run in self.runs if run.recording is not None and is_driven(run.recording))


def fitted(campaign: Campaign) -> tuple[Told, ...]:
    """Of every thruster of the campaign, also of those that were never measured."""
    return tuple(_fitted(name, campaign.runs_of(name)) for name in campaign.thrusters)


def _fitted(thruster: str, runs: tuple[Run, ...]) -> Told:
    told = Told(thruster, runs, None)
    if not runs:
        return replace(told, why_no_fit="it was never begun")
    if not told.recordings:
        wrong = "; ".join(run.wrong for run in runs if run.wrong)
        return replace(told, why_no_fit=wrong or "its recordings hold a tare and nothing driven")
    try:
        (answer,) = fit_recordings(told.recordings)
    except RecordingError as error:
        return replace(told, why_no_fit=str(error))
    return replace(told, answer=answer)


class TimeIsUp:
    """An observer of a diagnosis that ends its search with what it has when its time is over."""

    def __init__(self, inner: Observer, end: float, now: Callable[[], float] = monotonic) -> None:
        """`end`: s, on the clock of `now`."""
        self._inner, self._end, self._now = inner, end, now
        self.over = False
        """Whether the search was ended."""

    def stage(self, name: str) -> None:
        self._inner.stage(name)

    def trying(self, what: str) -> None:
        """Raises Interrupted when the time is over."""
        from identification.mismatch.observer import Interrupted

        if self._now() > self._end:
            self.over = True
            raise Interrupted
        self._inner.trying(what)


Watched = Callable[[], "AbstractContextManager[Observer]"]
"""Begins what shows how far a diagnosis is."""


def diagnosed(told: Sequence[Told], seconds: float, watched: Watched, say: Callable[[str], None]) -> tuple[Told, ...]:
    """With a diagnosis of each thruster that has a fit; each search has `seconds`, then it ends with what it has."""
    out = []
    for each in told:
        if each.answer is not None:
            say(f"diagnosing {each.thruster} ({seconds:g} s at most for its search)")
        out.append(_diagnosed(each, seconds, watched) if each.answer is not None else each)
    return tuple(out)


def _diagnosed(told: Told, seconds: float, watched: Watched) -> Told:
    from rig.diagnose.command import traced

    try:
        with watched() as inner:
            timed = TimeIsUp(inner, monotonic() + seconds)
            found = traced(told.recordings, observer=timed).diagnosis
    except RecordingError as error:
        return replace(told, why_no_diagnosis=str(error))
    return replace(told, diagnosis=found, cut_short=timed.over)


def earlier(folder: Path) -> list[Path]:
    """Fits of the campaigns that the same output folder holds from before this one, newest first.

    By the date and time in the folders' names, so that a copied folder is as old as what it holds.
    """
    own = _STAMP.search(folder.name)
    if own is None:
        return []
    fits = folder.parent.glob(f"*/{FIT_FILE}")
    dated = [(found[1], path) for path in fits if (found := _STAMP.search(path.parent.name))]
    return [path for date, path in sorted(dated, reverse=True) if date < own[1]][:MOST_EARLIER]


def compared(told: Sequence[Told], given: Iterable[Path], folder: Path) -> tuple[tuple[Changed, ...], tuple[str, ...]]:
    """Each earlier campaign against this one, and the sentences why one could not be compared.

    `given`: campaign folders or fits that are asked for by name, of which a fault is raised as RecordingError; with
    none, those that `earlier` finds, whose faults are told and left.
    """
    answers = [each.answer for each in told if each.answer is not None]
    asked = [fits_of(path) for path in given]
    found, faults = [], []
    for path in (asked or earlier(folder)) if answers else ():
        try:
            one = changed(answers, path)
        except RecordingError as error:
            if asked:
                raise
            faults.append(str(error))
            continue
        if one.changes or asked:
            found.append(replace(one, source=path.parent.name if path.name == FIT_FILE else path.name))
    return tuple(found), tuple(faults)


def fits_of(path: Path) -> Path:
    """The fits of a campaign's folder, or the file itself. Raises RecordingError where there are none."""
    if not path.is_dir():
        return path
    if not (path / FIT_FILE).is_file():
        raise RecordingError(
            f"{path}: expected {FIT_FILE} in it, which the end of a campaign leaves there; make it with "
            f"`rig fit {path} --json {path / FIT_FILE}`"
        )
    return path / FIT_FILE
