"""Entries of campaigns: what the ledger in a campaign's folder says."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rig.catalogue.entry import UNREADABLE, Entry
from rig.catalogue.reading.recordings import bench_name
from rig.errors import RecordingError
from rig.recording.facts import Fact
from rig.recording.ledger import finished_runs, read


def read_campaign(folder: Path, path: str) -> list[Entry]:
    """Of a ledger; none for one in which nothing was begun."""
    try:
        facts = read((folder / path).parent)
    except (RecordingError, OSError) as error:
        reason = str(error).removeprefix(str(folder / path)).lstrip(": ")
        return [Entry("campaigns", path, _id(path), outcome=UNREADABLE, reason=reason)]
    begun = [fact for fact in facts if fact["fact"] in ("start", "resume")]
    return [_entry(path, begun[0], facts)] if begun else []


def _id(path: str) -> str:
    """The name of the folder; empty for the folder that is listed."""
    return Path(path).parent.name


def _entry(path: str, start: Fact, facts: Sequence[Fact]) -> Entry:
    thrusters, done = [str(name) for name in start["thrusters"]], list(finished_runs(facts))
    last = next(fact for fact in reversed(facts) if fact["fact"] in ("start", "resume", "end"))
    runs = [fact for fact in facts if fact["fact"] == "run_start"]
    ends = {Path(fact["recording"]).name: str(fact["outcome"]) for fact in facts if fact["fact"] == "run_end"}
    return Entry(
        "campaigns",
        path,
        id=_id(path),
        thruster=thrusters[0] if len(thrusters) == 1 else "",
        campaign=str(start["campaign"]),
        outcome=str(last.get("outcome", "running")),
        bench=bench_name(start["bench_toml"]),
        said=f"{len(done)} of {len(thrusters)} thrusters measured: {', '.join(thrusters)}",
        reason=str(last.get("cause", "")),
        facts={
            "thrusters": thrusters,
            "measured": done,
            "runs": [
                {
                    "thruster": str(run["thruster"]),
                    "recording": Path(run["recording"]).name,
                    "recording_id": str(run.get("recording_id", "")),
                    "outcome": ends.get(Path(run["recording"]).name, "running"),
                }
                for run in runs
            ],
        },
        recordings=tuple(dict.fromkeys(str(run["recording_id"]) for run in runs if run.get("recording_id"))),
    )
