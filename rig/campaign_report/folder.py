"""What a campaign's folder holds: its facts, and each thruster's recordings, the damaged ones with what is wrong."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from identification.recording import Recording
from rig.errors import RecordingError
from rig.hdf5 import load
from rig.names import file_inside
from rig.recording.ledger import FILE_NAME, Fact, read
from rig.report.provenance import sha256


@dataclass(frozen=True, eq=False)
class Run:
    """One run of a thruster: its file, how it ended, and what was recorded where that can be read."""

    thruster: str
    path: Path
    outcome: str
    """`completed`, `aborted`, `tripped`; `cut` where nobody wrote its end down."""
    cause: str
    recording: Recording | None
    wrong: str = ""
    """What is wrong with the file, a sentence; empty when it is as it was closed."""
    sha256: str = ""

    @property
    def used(self) -> bool:
        return self.recording is not None


@dataclass(frozen=True, eq=False)
class Campaign:
    """A campaign as its folder has it. Texts that are not known are empty."""

    folder: Path
    name: str
    thrusters: tuple[str, ...]
    """All that were to be measured, in the order of the campaign."""
    runs: tuple[Run, ...]
    outcome: str
    cause: str
    texts: Mapping[str, str]
    """`campaign.toml` and `bench.toml`, verbatim."""
    identities: Mapping[str, str]
    """Device of the bench -> what it said it is."""
    resumed: int = 0
    """How often the campaign was gone on with after a cut."""
    wrong: str = ""
    """What is wrong with the ledger, a sentence."""

    def runs_of(self, thruster: str) -> tuple[Run, ...]:
        return tuple(run for run in self.runs if run.thruster == thruster)

    @property
    def recordings(self) -> tuple[Recording, ...]:
        return tuple(run.recording for run in self.runs if run.recording is not None)

    def said(self, attribute: str) -> str:
        """What the recordings say of `operator`, `notes` ...; each different text once."""
        found = (r.attributes.get(attribute) for r in self.recordings)
        return "; ".join(dict.fromkeys(str(text) for text in found if text))

    @property
    def missing(self) -> tuple[str, ...]:
        """Thrusters without a run that came to its end."""
        done = {run.thruster for run in self.runs if run.outcome == "completed"}
        return tuple(name for name in self.thrusters if name not in done)


def campaign_in(folder: Path) -> Campaign:
    """Raises RecordingError for a folder without a ledger and without recordings."""
    try:
        facts = read(folder)
    except RecordingError as error:
        return _without_ledger(folder, str(error))
    begun = next((fact for fact in facts if fact["fact"] == "start"), None)
    if begun is None:
        raise RecordingError(f"{folder}: the campaign was never started, so there is nothing to tell; use `rig run`")
    ends = [fact for fact in facts if fact["fact"] in ("end", "resume")]
    last = ends[-1] if ends and ends[-1]["fact"] == "end" else None
    return Campaign(
        folder,
        begun["campaign"],
        tuple(dict.fromkeys(begun["thrusters"])),
        tuple(_runs(facts, folder)),
        last["outcome"] if last else "cut",
        last["cause"] if last else "nobody wrote its end down: the controller was killed, or its disk was full",
        {name: begun[name] for name in ("campaign_toml", "bench_toml")},
        begun["identities"],
        sum(fact["fact"] == "resume" for fact in facts),
    )


def _runs(facts: Sequence[Fact], folder: Path) -> Iterable[Run]:
    """In the order in which they were begun."""
    ends = {Path(fact["recording"]).name: fact for fact in facts if fact["fact"] == "run_end"}
    for fact in facts:
        if fact["fact"] != "run_start":
            continue
        path = file_inside(folder, Path(fact["recording"]).stem, ".h5")
        end = ends.get(path.name)
        if end is None:
            yield _run(fact["thruster"], path, "cut", "nobody wrote its end down", "")
        else:
            yield _run(fact["thruster"], path, end["outcome"], end["cause"], end["sha256"])


def _run(thruster: str, path: Path, outcome: str, cause: str, closed: str) -> Run:
    """With the recording where it can be read; `closed`: SHA-256 that it was closed with, empty where not known."""
    if not path.is_file():
        return Run(thruster, path, outcome, cause, None, f"{path.name} is not in the folder any more")
    found = sha256(path)
    changed = closed and closed != found
    wrong = f"{path.name} is not what was closed: its SHA-256 is not that of {FILE_NAME}" if changed else ""
    try:
        recording = load(path)
    except (RecordingError, OSError) as error:
        help_ = f"`rig recover {path.name} -o OUT.h5` saves what can be read"
        return Run(thruster, path, outcome, cause, None, f"{error}; {help_}", found)
    return Run(thruster, path, outcome, cause, recording, wrong, found)


def _without_ledger(folder: Path, wrong: str) -> Campaign:
    """What the recordings say by themselves."""
    paths = sorted(folder.glob("*.h5"))
    if not paths:
        raise RecordingError(wrong)
    runs = []
    for path in paths:
        found = _run(path.stem, path, "cut", "", "")
        said = found.recording
        if said is not None:
            outcome = said.outcome or ("completed" if said.complete else "cut")
            found = Run(said.thruster, path, outcome, said.cause, said, "", found.sha256)
        runs.append(found)
    first: Mapping[str, Any] = next((r.recording.attributes for r in runs if r.recording is not None), {})
    return Campaign(
        folder,
        str(first.get("campaign", "")) or folder.name,
        tuple(dict.fromkeys(run.thruster for run in runs)),
        tuple(runs),
        "cut",
        "how it ended can't be told without its ledger",
        {name: str(first.get(name, "")) for name in ("campaign_toml", "bench_toml")},
        {},
        wrong=wrong,
    )
