"""The stage: recordings in, their histories on intervals out, or a sentence that says why they cannot be diagnosed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from identification.mismatch.prepare.admission import unfit
from identification.mismatch.prepare.chain.acquisition import as_sampled
from identification.mismatch.prepare.preparing import Refusal, history_of
from identification.recording import Recording
from identification.run_history.history import History
from identification.twin import Twin


@dataclass(frozen=True, eq=False, slots=True)
class Prepared:
    """The runs to be diagnosed and those held out, each with its recording, in the order given."""

    recordings: tuple[Recording, ...]
    histories: tuple[History, ...]
    held_out: tuple[Recording, ...]
    unseen: tuple[History, ...]
    """Of what is held out."""
    moved: tuple[tuple[str, ...], ...] = ()
    """Of each recording to be diagnosed, a sentence for each stream whose stamps were brought back to its samples."""
    early: float = 0.0
    """s by which the force comes before its command, where that was found."""


def run(
    recordings: Sequence[Recording], holdout: Sequence[Recording], baseline: Twin | None, early: float = 0.0
) -> Prepared | Refusal:
    """Recordings of one thruster, driven by one quantity, that fit together and to the twin, if there is one.

    `early`: s by which the force comes before its command, where that is known.
    A Refusal says which of them do not, and why.
    """
    sampled = [as_sampled(recording) for recording in recordings]
    recordings, moved = [each for each, _ in sampled], tuple(told for _, told in sampled)
    holdout = [as_sampled(recording)[0] for recording in holdout]
    histories = histories_of(recordings, early)
    if isinstance(histories, Refusal):
        return histories
    unseen = histories_of(holdout, early) if holdout else ()
    if isinstance(unseen, Refusal):
        return unseen
    wrong = unfit(recordings, holdout, histories, unseen, baseline)
    return wrong or Prepared(tuple(recordings), histories, tuple(holdout), unseen, moved, early)


def histories_of(recordings: Sequence[Recording], early: float = 0.0) -> tuple[History, ...] | Refusal:
    """Of recordings that may be diagnosed together."""
    if not recordings:
        return Refusal("no recording was given")
    seen = {r.thruster for r in recordings}
    if len(seen) > 1:
        return Refusal(f"recordings of several thrusters ({', '.join(sorted(seen))}); diagnose one at a time")
    ids = [r.recording_id for r in recordings]
    if len(set(ids)) < len(ids):
        return Refusal("the same recording was given twice")
    out = []
    for recording in recordings:
        history = history_of(recording, early=early)
        if isinstance(history, Refusal):
            return history
        out.append(history)
    if len({h.driver_quantity for h in out}) > 1:
        return Refusal("the recordings are driven by different quantities; give those with one kind of command")
    return tuple(out)
