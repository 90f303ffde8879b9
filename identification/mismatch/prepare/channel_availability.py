"""What some recordings hold and others do not: left aside where fitted, and a held-out run may not be predicted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identification.mismatch.estimate.estimate import Estimate
from identification.recording import Recording
from identification.run_history.history import History

MOST_NAMED = 3
"""Recordings that a note names one by one."""


def held_by_all(
    recordings: Sequence[Recording], histories: Sequence[History]
) -> tuple[tuple[History, ...], tuple[str, ...]]:
    """The runs with what all of them hold beside thrust and driver, and a note on each quantity left aside."""
    held = [set(h.others) for h in histories]
    some, all_of_them = set.union(*held), set.intersection(*held)
    if some == all_of_them:
        return tuple(histories), ()
    kept = tuple(replace(h, others={q: v for q, v in h.others.items() if q in all_of_them}) for h in histories)
    notes = []
    for quantity in sorted(some - all_of_them):
        without = [r for r, h in zip(recordings, histories, strict=True) if quantity not in h.others]
        notes.append(
            f"{quantity} was left aside: {_named(without, len(histories))} no such channel, and what explains the "
            "thrust must be recorded in every run."
        )
    return kept, tuple(notes)


def predictable(
    holdout: Sequence[Recording], others: Sequence[History], estimate: Estimate
) -> tuple[tuple[History, ...], tuple[str, ...]]:
    """Of the runs held out, those that hold what the model looks at, and a note on each that does not."""
    kept, notes = [], []
    for recording, history in zip(holdout, others, strict=True):
        lacking = {q: t.id for t in estimate.fit.model.terms for q in t.needs if q not in history.others}
        if not lacking:
            kept.append(history)
            continue
        needs = ", ".join(f"{quantity} ({effect} needs it)" for quantity, effect in lacking.items())
        notes.append(f"{_name(recording)} was held out, but cannot be predicted and judges nothing: it lacks {needs}.")
    return tuple(kept), tuple(notes)


def _named(recordings: Sequence[Recording], of: int) -> str:
    """Who has not got it, with the verb."""
    if len(recordings) > MOST_NAMED:
        return f"{len(recordings)} of {of} recordings have"
    return f"{', '.join(map(_name, recordings))} {'has' if len(recordings) == 1 else 'have'}"


def _name(recording: Recording) -> str:
    return recording.source or recording.recording_id
