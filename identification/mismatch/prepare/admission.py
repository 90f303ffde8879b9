"""Which recordings may be diagnosed together, and against which twin: why not, in one sentence."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product

import numpy as np

from identification.mismatch import policy
from identification.mismatch.prepare.preparing import Refusal
from identification.recording import Recording
from identification.run_history.history import CHANGED, History
from identification.twin import Twin


def unfit(
    recordings: Sequence[Recording],
    holdout: Sequence[Recording],
    histories: Sequence[History],
    others: Sequence[History],
    twin: Twin | None,
) -> Refusal | None:
    """Why these cannot be diagnosed together, or against this twin: the first reason; None where there is none."""
    return (
        _of_another_thruster(recordings, holdout)
        or _held_out_twice(recordings, holdout)
        or _driven_otherwise(holdout, others, histories[0].driver_quantity)
        or _first(_too_little(r.source or r.recording_id, h) for r, h in zip(recordings, histories, strict=True))
        or (None if twin is None else _unlike(twin, recordings[0], histories[0].driver_quantity))
        or (None if twin is None else _lacking_for(twin, (*histories, *others)))
    )


def _first(refusals: Iterable[Refusal | None]) -> Refusal | None:
    return next((each for each in refusals if each is not None), None)


def _of_another_thruster(recordings: Sequence[Recording], holdout: Sequence[Recording]) -> Refusal | None:
    thruster = recordings[0].thruster
    other = next((r for r in holdout if r.thruster != thruster), None)
    if other is None:
        return None
    return Refusal(
        f"{other.source or other.recording_id} is of thruster {other.thruster}, the recordings to be diagnosed are "
        f"of {thruster}; hold out a recording of {thruster}"
    )


def _held_out_twice(recordings: Sequence[Recording], holdout: Sequence[Recording]) -> Refusal | None:
    twice = next((r for r in holdout if any(r.recording_id == q.recording_id for q in recordings)), None)
    if twice is None:
        return None
    return Refusal(
        f"{twice.source or twice.recording_id} is both to be diagnosed and held out; hold out another recording"
    )


def _driven_otherwise(holdout: Sequence[Recording], others: Sequence[History], driver: str) -> Refusal | None:
    pairs = zip(holdout, others, strict=True)
    otherwise = next(((r, h) for r, h in pairs if h.driver_quantity != driver), None)
    if otherwise is None:
        return None
    recording, history = otherwise
    return Refusal(
        f"{recording.source or recording.recording_id} is driven by {history.driver_quantity}, the recordings "
        f"to be diagnosed by {driver}; hold out a recording with {driver}"
    )


def _unlike(twin: Twin, recording: Recording, driver: str) -> Refusal | None:
    if twin.thruster != recording.thruster:
        return Refusal(
            f"the twin is of thruster {twin.thruster}, the recording {recording.source} is of {recording.thruster}; "
            f"give the twin of {recording.thruster}, or ask for --any-thruster"
        )
    if twin.driver_quantity != driver:
        return Refusal(
            f"the twin is driven by {twin.driver_quantity}, the recording by {driver}; both must be the same"
        )
    return None


def _lacking_for(twin: Twin, histories: Sequence[History]) -> Refusal | None:
    for term, history in product(twin.terms, histories):
        lacking = sorted(set(term.term.needs) - set(history.others))
        if lacking:
            return Refusal(
                f"the twin's {term.effect} needs {', '.join(lacking)}, which {history.recording_id} does not hold; "
                "diagnose it without the twin"
            )
    return None


def _too_little(name: str, history: History) -> Refusal | None:
    """What a line through two points would describe without a residual is not diagnosed."""
    samples, driven = int(history.count.sum()), history.driver[history.rows]
    levels = 1 + int(np.count_nonzero(np.abs(np.diff(driven)) > CHANGED * history.size))
    if samples < policy.prepare.COURSE_SAMPLES and samples > policy.prepare.TABLE_SAMPLES * levels:
        return Refusal(
            f"{name} has {samples} thrust samples, at least {policy.prepare.COURSE_SAMPLES} are needed to tell "
            "physics from noise; record for longer"
        )
    if float(np.ptp(driven)) <= policy.prepare.ONE_LEVEL * history.size:
        return Refusal(
            f"{name} has thrust at one level of {history.driver_quantity} only ({driven[0]:.4g}); at least two levels "
            "are needed"
        )
    return None
