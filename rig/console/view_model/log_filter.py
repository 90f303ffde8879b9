"""Which events are shown: those of this run, warnings and worse, or all. Pure."""

from __future__ import annotations

from typing import Final, Literal

from rig.link.front_end_messages import LogLine, Snapshot

LogFilter = Literal["run", "worse", "all"]
NEXT: Final[dict[LogFilter, LogFilter]] = {"run": "worse", "worse": "all", "all": "run"}
TITLES: Final[dict[LogFilter, str]] = {
    "run": "events of this run  (f: warnings and worse)",
    "worse": "warnings and worse  (f: all events)",
    "all": "all events  (f: this run)",
}
BEFORE: Final = -1
"""Run of the events before the campaign was started."""


def run_of(snapshot: Snapshot) -> int:
    """The run that goes on, or that ended last."""
    return snapshot.progress.run if snapshot.progress is not None else BEFORE


def wanted(line: LogLine, chosen: LogFilter, run: int) -> bool:
    """Whether the filter lets it through; what ended a campaign always."""
    if chosen == "all" or line.level in ("trip", "error"):
        return True
    return line.run == run if chosen == "run" else line.level != "info"
