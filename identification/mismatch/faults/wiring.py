"""The first stage: recordings as they came in; those that are wired alike out, and what was found wrong in the others.

A channel that was exchanged, reversed or recorded in another unit is put right, for that is exact. What is changed by
another factor, or follows nothing, is left out: the channel alone where no model of the thrust needs it, else the run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from identification.mismatch.faults.between_runs import Differs, differing
from identification.mismatch.faults.cells import DRIVERS
from identification.mismatch.faults.channel_faults import Fault, find_faults, repaired
from identification.mismatch.faults.wiring_words import name_of, said, unit_of
from identification.mismatch.value import Value
from identification.recording import Recording


@dataclass(frozen=True, eq=False, slots=True)
class Wired:
    """Runs whose channels mean the same."""

    recordings: tuple[Recording, ...]
    holdout: tuple[Recording, ...]
    faults: tuple[Fault, ...]


def run(recordings: Sequence[Recording], holdout: Sequence[Recording]) -> Wired:
    """All runs beside one another. One of `recordings` at least stays: what is held out is left out in its place."""
    told: list[Fault] = []
    now = {r.recording_id: r for r in (*recordings, *holdout)}
    mine = {r.recording_id for r in recordings}
    for one in map(_unconverted, _unexplained_alone([*now.values()])):
        name = one.recording.recording_id
        last = mine & set(now) == {name}
        fault, right = _fault(one, last=last)
        if right is not None:
            now[name] = right
        elif not last:
            del now[name]
        elif one.beside is not None:
            now.pop(one.beside.recording_id, None)
        told.append(fault)
    kept, unseen = (tuple(now[r.recording_id] for r in part if r.recording_id in now) for part in (recordings, holdout))
    return Wired(kept, unseen, tuple(told))


def _unexplained_alone(every: Sequence[Recording]) -> list[Differs]:
    """Without those of which a fault within the run explains all: they are found and put right by themselves.

    An exchange stays: of a supply in the place of a current the run by itself would say that its sign is turned.
    """
    found = differing(every)
    if not found:
        return []
    flagged = {one.recording.recording_id for one in found}
    flagged |= {one.beside.recording_id for one in found if one.beside is not None and not one.known}
    again = {
        one.recording.recording_id for one in differing([_mended(r) if r.recording_id in flagged else r for r in every])
    }
    return [one for one in found if one.changed.kind == "swapped" or one.recording.recording_id in again]


def _mended(recording: Recording) -> Recording:
    for fault in find_faults([recording]):
        if fault.grave and fault.repairable:
            recording = repaired(recording, fault)
    return recording


def _unconverted(one: Differs) -> Differs:
    """Of two runs, that one is in another unit whose figures were left as the device gave them.

    Nobody knows where either may be: one in kN, or the other in mN.
    """
    unit = unit_of(one.changed)
    if one.known or unit is None or one.beside is None:
        return one
    turned = replace(one.changed, factor=1.0 / one.changed.factor)
    if not unit.inverse:
        other = unit_of(turned)
        return replace(one, known=other is None or other.inverse)
    return replace(one, recording=one.beside, beside=one.recording, changed=turned, known=True)


def _needed(recording: Recording) -> tuple[str, ...]:
    """Channels without which a run says nothing of the thruster: the thrust, and the best of what may drive it."""
    held = {c.quantity for c in recording.channels}
    return ("thrust", *[q for q in DRIVERS if q in held][:1])


def _fault(one: Differs, *, last: bool) -> tuple[Fault, Recording | None]:
    """What is told of a run, and the run put right; None where nothing can be. `last`: no other run would be left."""
    change, recording = one.changed, one.recording
    unit = unit_of(change)
    exact = change.kind in ("swapped", "reversed") or unit is not None
    values = {}
    if change.kind in ("rescaled", "driver"):
        factor = change.factor if unit is None else unit.factor
        values["factor"] = Value(factor, 0.0 if unit else factor * change.error, "1")
    kind = change.kind
    statement = said(one)
    fault = Fault(
        recording.recording_id, change.channel, kind, statement, change.p_value, values, change.other, done="told"
    )
    if exact:
        done = f"{name_of(recording)}: {change.channel} was put right for the model."
        return replace(fault, done=done), repaired(recording, fault)
    if change.sure and change.channel not in _needed(recording):
        kept = tuple(c for c in recording.channels if c.quantity != change.channel)
        done = f"{name_of(recording)}: {change.channel} was left out of the model."
        return replace(fault, done=done), replace(recording, channels=kept)
    if last:
        done = f"{name_of(recording)} is all there is to be diagnosed, and was left as it is: what follows rests on it."
        if one.beside is not None:
            done += f" {name_of(one.beside)}, which differs from it, judges nothing."
        return replace(fault, done=done), None
    return replace(fault, done=f"{name_of(recording)} was left out of the model."), None
