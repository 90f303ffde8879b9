"""What the recordings of a campaign hold of its plan. The files are believed, and of the ledger what they bear out.

A step counts where its row says that it ran to its end and the samples of its time are there; it counts whatever became
of the run after it. So what a kill cut off is measured again, and nothing else is.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identification.recording import Channel, Recording
from identification.recording import Step as StepRow
from rig.campaign.plan import Plan, Step
from rig.errors import RecordingError
from rig.hdf5 import load
from rig.link.processes import holders
from rig.names import file_inside
from rig.recording.ledger import FILE_NAME, Fact
from rig.recording.recorder import sha256_of
from rig.sequence.steady import LEAST_SAMPLES

LATE = 0.1
"""s that the last sample of a step may come before its end: the row of a step is sent a tick before the samples of that
tick, and a slow line is behind the rest."""
LATE_ROWS = 3
"""Sample periods that it may, of a slow stream."""
CLOSING = 20.0
"""s for a recorder whose controller was killed to close its file."""


@dataclass(frozen=True, slots=True)
class Measured:
    """Of one thruster."""

    recordings: tuple[str, ...] = ()
    """Names of the files that hold a part of it, in the order of the campaign."""
    steps: frozenset[int] = frozenset()
    """Indices in the plan."""
    continues: str = ""
    """Id of the last of these recordings."""


def measured(facts: Sequence[Fact], folder: Path, thruster: str, plan: Plan) -> Measured:
    """What all runs of a thruster have measured. Raises RecordingError for a ledger that the files do not bear out.

    A run that has measured nothing but tares is left aside.
    """
    found = Measured()
    for fact in facts:
        if fact["fact"] != "run_start" or fact["thruster"] != thruster:
            continue
        path = recording_of(fact, facts, folder)
        try:
            recording = load(path)
        except RecordingError as error:
            raise RecordingError(f"{error}; {_without(path, facts)}") from error
        _require_same(recording, path, fact, facts)
        steps = steps_in(recording, plan)
        if any(step.measures for step in plan if step.index in steps):
            found = Measured((*found.recordings, path.name), found.steps | steps, recording.recording_id)
    return found


def recording_of(run: Fact, facts: Sequence[Fact], folder: Path) -> Path:
    """The file of a run that was begun, once nobody writes it any more.

    It is looked for in the campaign's folder, wherever that was when the run was begun.
    """
    path = file_inside(folder, Path(run["recording"]).stem, ".h5")
    if not path.is_file():
        raise RecordingError(f"{folder / FILE_NAME} names {path.name}, which is not there; {_without(path, facts)}")
    _await_closed(path)
    ends = [fact for fact in facts if fact["fact"] == "run_end" and _names(fact, path.name) and fact["sha256"]]
    if ends and sha256_of(path) != ends[-1]["sha256"]:
        raise RecordingError(
            f"{path} is not what was closed: its SHA-256 is not that of {FILE_NAME}:{facts.index(ends[-1]) + 1}; put "
            "the original back"
        )
    return path


def steps_in(recording: Recording, plan: Plan) -> frozenset[int]:
    """Indices of the plan's steps that a recording holds whole."""
    return frozenset(_whole(recording, tuple(plan)))


def _whole(recording: Recording, plan: Sequence[Step]) -> Iterator[int]:
    rows: dict[int, list[StepRow]] = {}
    for row in recording.steps:
        rows.setdefault(row.index, []).append(row)
    furthest = max(rows, default=-1)
    thrust = recording.first_of("thrust")
    for step in plan:
        own = [row for row in rows.get(step.index, ()) if row.phase == step.phase]
        passed = step.index < furthest and (step.phase == "rest" or (step.phase == "ramp" and not step.swept))
        tried = step.phase == "tare" and 0 < step.index < furthest and step.index in rows
        if passed or tried or any(_has_samples(row, step, thrust) for row in own):
            yield step.index


def _has_samples(row: StepRow, step: Step, thrust: Channel | None) -> bool:
    """Enough for a point, up to the end of the step."""
    if not step.measures and step.phase != "tare":
        return True
    if thrust is None or thrust.time.size < LEAST_SAMPLES:
        return False
    period = float(np.median(np.diff(thrust.time)))
    time_, value = thrust.window(row.t_start + step.settle, row.t_end)
    enough = np.isfinite(value).sum() >= LEAST_SAMPLES
    return bool(enough and time_[-1] >= row.t_end - max(LATE, LATE_ROWS * period))


def _names(fact: Fact, recording: str) -> bool:
    told = [fact["recording"]] if "recording" in fact else fact.get("recordings", ())
    return any(Path(each).name == recording for each in told)


def _without(path: Path, facts: Sequence[Fact]) -> str:
    """What can be done about a file that is lost."""
    lines = [str(number) for number, fact in enumerate(facts, 1) if _names(fact, path.name)]
    return (
        f"put it back; or, if it is lost, take the lines out of {FILE_NAME} that name it ({', '.join(lines)}): its "
        "steps are measured again then"
    )


def _require_same(recording: Recording, path: Path, run: Fact, facts: Sequence[Fact]) -> None:
    """The file is the one that the ledger means."""
    begun = next(fact for fact in facts if fact["fact"] == "start")
    for name, found, wanted in (
        ("thruster", recording.thruster, run["thruster"]),
        ("recording_id", recording.recording_id, run.get("recording_id", recording.recording_id)),
        ("campaign_toml", recording.attributes.get("campaign_toml"), begun["campaign_toml"]),
    ):
        if found != wanted:
            raise RecordingError(
                f"{path} is not the recording that {FILE_NAME} means: its {name} is {str(found)[:60]!r}, "
                f"expected {wanted[:60]!r}; put the original back"
            )


def _await_closed(path: Path) -> None:
    """Raises RecordingError when some process has it open for longer than a recorder needs to close it."""
    end = time.monotonic() + CLOSING
    while there := holders(path):
        if time.monotonic() > end:
            raise RecordingError(
                f"{path} is still open in process {there[0]}, {CLOSING:g} s after its controller ended: end that "
                "process, then resume"
            )
        time.sleep(0.1)
