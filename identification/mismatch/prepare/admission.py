"""Which recordings may be diagnosed together, and against which twin: why not, in one sentence."""

from __future__ import annotations

from collections.abc import Sequence

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
    """Why these cannot be diagnosed together, or against this twin."""
    thruster, driver = recordings[0].thruster, histories[0].driver_quantity
    other = next((r for r in holdout if r.thruster != thruster), None)
    if other is not None:
        return Refusal(
            f"{other.source or other.recording_id} is of thruster {other.thruster}, the recordings to be diagnosed are "
            f"of {thruster}; hold out a recording of {thruster}"
        )
    twice = next((r for r in holdout if any(r.recording_id == q.recording_id for q in recordings)), None)
    if twice is not None:
        return Refusal(
            f"{twice.source or twice.recording_id} is both to be diagnosed and held out; hold out another recording"
        )
    for recording, history in zip(holdout, others, strict=True):
        if history.driver_quantity != driver:
            return Refusal(
                f"{recording.source or recording.recording_id} is driven by {history.driver_quantity}, the recordings "
                f"to be diagnosed by {driver}; hold out a recording with {driver}"
            )
    for recording, history in zip(recordings, histories, strict=True):
        few = _too_little(recording.source or recording.recording_id, history)
        if few is not None:
            return few
    if twin is None:
        return None
    if twin.thruster != thruster:
        return Refusal(
            f"the twin is of thruster {twin.thruster}, the recording {recordings[0].source} is of {thruster}; give the "
            f"twin of {thruster}, or ask for --any-thruster"
        )
    if twin.driver_quantity != driver:
        return Refusal(
            f"the twin is driven by {twin.driver_quantity}, the recording by {driver}; both must be the same"
        )
    for term in twin.terms:
        for history in (*histories, *others):
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
