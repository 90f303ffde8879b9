"""campaign.jsonl: what was done, one line per fact, fsynced within the next steps. What `rig resume` believes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rig.campaign.config import CampaignConfig
from rig.errors import RecordingError
from rig.recording.line_writer import LineWriter

FILE_NAME = "campaign.jsonl"

Fact = Mapping[str, Any]


@dataclass(frozen=True)
class Ledger:
    """Appends facts; each is fsynced by a thread, so that a slow disk does not hold the control loop."""

    path: Path
    writer: LineWriter

    @classmethod
    def open(cls, folder: Path) -> Ledger:
        """Also one that is there already, after a kill: a last line that was torn is no fact and is cut off."""
        path = folder / FILE_NAME
        file = path.open("ab")
        file.truncate(path.read_bytes().rfind(b"\n") + 1)
        return cls(path, LineWriter(file, sync=True))

    @property
    def error(self) -> str:
        """Why facts are no longer written, as a sentence; empty while they are."""
        return self.writer.error

    def write(self, fact: str, **details: Any) -> None:
        """Never blocks."""
        self.writer.write(json.dumps({"fact": fact, **details}))

    def close(self) -> None:
        """All facts are on the disk when this returns, if it takes them."""
        self.writer.close()


def read(folder: Path) -> list[Fact]:
    """All facts of a campaign folder; a torn last line (power cut while writing) is left out."""
    path = folder / FILE_NAME
    if not path.exists():
        raise RecordingError(f"{folder}: expected a campaign folder with {FILE_NAME} in it, found none")
    facts = []
    lines = path.read_text(encoding="utf-8").split("\n")
    for number, line in enumerate(lines, 1):
        if not line:
            continue
        try:
            facts.append(json.loads(line))
        except json.JSONDecodeError as error:
            if number == len(lines):
                break
            raise RecordingError(f"{path}:{number}: not a line of JSON ({error}); the ledger was edited") from error
    return facts


def finished_runs(facts: Sequence[Fact]) -> dict[str, str]:
    """Thruster -> recording of the runs that ended `completed`, in the order they were run."""
    ends = (fact for fact in facts if fact["fact"] == "run_end" and fact["outcome"] == "completed")
    return {fact["thruster"]: fact["recording"] for fact in ends}


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
