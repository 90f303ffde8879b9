"""What an operator marked as bad: it stays in the file, and no fit takes it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.recording import VOID, Channel, Event, Recording, Step


def without_voided(recording: Recording) -> Recording:
    """The same where nothing is marked. Else a step that is becomes `free`, and thrust in its time is missing (NaN).

    The marks stay among the steps, and each is a warning among the events.
    """
    spans = void_spans(recording.steps)
    if not spans:
        return recording
    told = [Event(e, "warning", f"{s:.2f} to {e:.2f} s was marked bad by the operator: left out") for s, e in spans]
    return replace(
        recording,
        steps=tuple(_unmarked(step, spans) for step in recording.steps),
        channels=tuple(_masked(channel, spans) for channel in recording.channels),
        events=(*recording.events, *told),
    )


def void_spans(steps: tuple[Step, ...]) -> tuple[tuple[float, float], ...]:
    """(t_start, t_end) of what is marked, s."""
    return tuple((step.t_start, step.t_end) for step in steps if step.phase == VOID)


def _unmarked(step: Step, spans: tuple[tuple[float, float], ...]) -> Step:
    marked = step.phase != VOID and (step.t_start, step.t_end) in spans
    return replace(step, phase="free") if marked else step


def _masked(channel: Channel, spans: tuple[tuple[float, float], ...]) -> Channel:
    if channel.quantity != "thrust":
        return channel
    value = channel.value.copy()
    for start, end in spans:
        low, high = np.searchsorted(channel.time, (start, end))
        value[low:high] = np.nan
    value.setflags(write=False)
    return replace(channel, value=value)
