"""campaign.jsonl: what was done, one line per fact, fsynced within the next steps. What `rig resume` begins with."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rig.campaign.config import CampaignConfig
from rig.errors import RecordingError
from rig.recording.facts import Fact, fact_of
from rig.recording.line_writer import LineWriter

FILE_NAME = "campaign.jsonl"

__all__ = [
    "FILE_NAME",
    "Fact",
    "Ledger",
    "attempts",
    "file_facts",
    "finished_runs",
    "kept_steps",
    "read",
    "recordings_before",
]


@dataclass(frozen=True)
class Ledger:
    """Appends facts; each is fsynced by a thread, so that a slow disk does not hold the control loop."""

    path: Path
    writer: LineWriter

    @classmethod
    def open(cls, folder: Path, *, at_once: bool = False) -> Ledger:
        """Also one that is there already, after a kill: a last line that was torn is no fact and is cut off.

        `at_once`: for virtual time. A fact is in the file when `write` returns, though not yet on the disk.
        """
        path = folder / FILE_NAME
        file = path.open("ab")
        file.truncate(path.read_bytes().rfind(b"\n") + 1)
        return cls(path, LineWriter(file, sync=not at_once, at_once=at_once))

    @property
    def error(self) -> str:
        """Why facts are no longer written, as a sentence; empty while they are."""
        return self.writer.error

    @property
    def settled(self) -> bool:
        """Every fact is in the file, or `error` says why it is not."""
        return self.writer.settled

    def write(self, fact: str, **details: Any) -> None:
        """Never blocks."""
        self.writer.write(json.dumps({"fact": fact, **details}))

    def close(self) -> None:
        """All facts are on the disk when this returns, if it takes them."""
        self.writer.close()


def read(folder: Path) -> list[Fact]:
    """All facts of a campaign folder; a torn last line (power cut while writing) is left out.

    Raises RecordingError for a ledger that is damaged: what one line tells wrongly, no other can be believed for.
    """
    path = folder / FILE_NAME
    if not path.is_file():
        raise RecordingError(f"{folder}: expected a campaign folder with {FILE_NAME} in it, found none")
    facts = []
    for number, line in enumerate(path.read_bytes().split(b"\n")[:-1], 1):
        try:
            facts.append(fact_of(line))
        except ValueError as error:
            raise RecordingError(
                f"{path}:{number}: {error}; the ledger was edited or damaged, and nothing is done by it: put the "
                "original back, or begin anew with `rig run` (recordings that are whole can be fitted as they are)"
            ) from None
    return facts


def finished_runs(facts: Sequence[Fact]) -> dict[str, str]:
    """Thruster -> recording of the runs that ended `completed`, in the order they were run."""
    ends = (fact for fact in facts if fact["fact"] == "run_end" and fact["outcome"] == "completed")
    return {fact["thruster"]: fact["recording"] for fact in ends}


def recordings_before(facts: Sequence[Fact], folder: Path) -> list[str]:
    """Paths of the recordings that hold what was measured before a campaign is resumed, in the order they were made."""
    completed = set(finished_runs(facts).values())
    names = [Path(each).name for each in completed]
    names += [name for fact in facts if fact["fact"] == "kept" for name in fact["recordings"]]
    made = [Path(fact["recording"]).name for fact in facts if fact["fact"] == "run_start"]
    return [str(folder / name) for name in made if name in names]


def kept_steps(facts: Sequence[Fact], thruster: str) -> Fact | None:
    """What `rig resume` found measured of a run that is to go on: its last word on that thruster, if no run of it
    was begun since."""
    told = [fact for fact in facts if fact["fact"] in ("kept", "run_start") and fact["thruster"] == thruster]
    return told[-1] if told and told[-1]["fact"] == "kept" else None


def attempts(facts: Sequence[Fact], thruster: str) -> int:
    """How often a run of that thruster was begun."""
    return sum(fact["fact"] == "run_start" and fact["thruster"] == thruster for fact in facts)


def file_facts(campaign: CampaignConfig) -> dict[str, str]:
    """Both files, verbatim and by their hash: what a resumed campaign must find unchanged."""
    return {
        "campaign_file": str(campaign.path.resolve()),
        "campaign_sha256": _sha256(campaign.text),
        "bench_sha256": _sha256(campaign.bench.text),
        "campaign_toml": campaign.text,
        "bench_toml": campaign.bench.text,
    }


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
