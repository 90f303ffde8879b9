"""campaign.jsonl: what was done, one line per fact, on the disk before the next step begins. What `rig resume` believes."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from io import TextIOWrapper
from pathlib import Path
from typing import Any

from rig.errors import RecordingError

FILE_NAME = "campaign.jsonl"


@dataclass
class Ledger:
    """Appends facts; every `write` is fsynced before it returns."""

    path: Path
    file: TextIOWrapper

    @classmethod
    def open(cls, folder: Path) -> Ledger:
        path = folder / FILE_NAME
        return cls(path, path.open("a", encoding="utf-8"))

    def write(self, fact: str, **details: Any) -> None:
        self.file.write(json.dumps({"fact": fact, **details}) + "\n")
        self.file.flush()
        os.fsync(self.file.fileno())

    def close(self) -> None:
        self.file.close()


def read(folder: Path) -> list[Mapping[str, Any]]:
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


def finished_thrusters(folder: Path) -> tuple[str, ...]:
    """Thrusters whose run ended `completed`, in the order they were run."""
    return tuple(
        fact["thruster"] for fact in read(folder) if fact["fact"] == "run_end" and fact["outcome"] == "completed"
    )
