"""The stage: prepared runs in, the same with grave channel faults put right out, and every fault that was found.

Faults come first: a channel that lies is taken for physics otherwise. Nothing is repaired in silence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from identification.mismatch.faults.channel_faults import Fault, find_faults, repaired
from identification.mismatch.prepare.channel_availability import held_by_all
from identification.mismatch.prepare.preparing import Refusal
from identification.mismatch.prepare.scales import of_one_rate
from identification.mismatch.prepare.stage import Prepared, histories_of
from identification.recording import Recording
from identification.run_history.history import History


@dataclass(frozen=True, eq=False, slots=True)
class Sound:
    """Runs whose channels may be believed."""

    histories: tuple[History, ...]
    """With what all of them hold."""
    unseen: tuple[History, ...]
    """Of what is held out."""
    faults: tuple[Fault, ...]
    notes: tuple[str, ...]
    """What was left aside, as not every run holds it."""


def run(prepared: Prepared, told: Sequence[Fault] = (), rate_per_driver: float | None = None) -> Sound | Refusal:
    """Refused where a recording that was put right cannot be diagnosed; `told`: faults that were put right before;
    `rate_per_driver`: of a twin, for all runs."""
    faults, histories = _put_right(prepared.recordings, prepared.histories, prepared.early)
    faults_of_unseen, unseen = _put_right(prepared.held_out, prepared.unseen, prepared.early)
    if isinstance(histories, Refusal):
        return histories
    if isinstance(unseen, Refusal):
        return unseen
    histories, notes = held_by_all(prepared.recordings, histories)
    histories = of_one_rate(histories, rate_per_driver)
    turning = next((h.rate_per_driver for h in histories if h.rate is not None), None)
    unseen = of_one_rate(unseen, turning)
    return Sound(histories, unseen, (*told, *faults, *faults_of_unseen), notes)


def _put_right(
    recordings: Sequence[Recording], histories: tuple[History, ...], early: float
) -> tuple[tuple[Fault, ...], tuple[History, ...] | Refusal]:
    faults = find_faults(recordings)
    if not any(f.grave and f.repairable for f in faults):
        return faults, histories
    mended = []
    for recording in recordings:
        right = recording
        for fault in faults:
            if fault.recording_id == recording.recording_id and fault.grave and fault.repairable:
                right = repaired(right, fault)
        mended.append(right)
    return faults, histories_of(mended, early)
