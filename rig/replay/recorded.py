"""A recording as the snapshots that a console would have had. Pure: a recording and a time in, a snapshot out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Literal

import numpy as np

from identification.recording import Channel, Recording, Step
from identification.steady_state.steady import SteadyMonitor
from rig.link.front_end_messages import (
    LogLine,
    Point,
    Progress,
    Reading,
    Snapshot,
    State,
    TracedChannel,
    TraceRow,
)

Level = Literal["info", "warning", "trip", "error"]
Outcome = Literal["completed", "aborted", "tripped"]

TENTH = 0.1
"""s of a row of the trace."""
SETTLING = 0.25
"""Of each hold, left out of its point: how long the run let it settle is not in a recording."""
COMMAND = "command_voltage"
STALE = 1.0
"""s without a row after which a reading is shown as old."""
LEVELS: Mapping[str, Level] = {"info": "info", "warning": "warning", "trip": "trip", "error": "error"}
STATES: Mapping[str, State] = {
    "tare": "tare", "ramp": "ramp", "hold": "hold", "rest": "rest", "sine": "sine", "free": "free",
}  # fmt: skip
"""Phases of a recording."""
OUTCOMES: Mapping[str, Outcome] = {"completed": "completed", "aborted": "aborted", "tripped": "tripped"}
NEWEST = 500
"""Log lines that travel with a snapshot."""


@dataclass
class Frames:
    """Of one recording; `snapshot` is asked with times that do not run backwards. Times in s of the recording."""

    recording: Recording
    path: str
    _traced: int = field(default=0, init=False)
    """Rows of the trace given so far."""
    _sequence: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        found = self.recording
        command = found.first_of(COMMAND)
        self._command = command
        self._measured = tuple(c for c in found.channels if c is not command)
        times = [c.time[[0, -1]] for c in found.channels if c.time.size]
        self.begin = float(min((t[0] for t in times), default=0.0))
        self.end = float(max((t[1] for t in times), default=0.0))
        self._traced = int(max(self.begin, 0.0) / TENTH)
        self._steps = sorted(found.steps, key=lambda step: step.t_start)
        self._points = _points(found)
        self._log = tuple(sorted(found.events, key=lambda event: event.time))

    def snapshot(self, t: float) -> Snapshot:
        """What was to be seen at `t`; from the end on the run is done."""
        over = t >= self.end
        step = self._step(t)
        self._sequence += 1
        log = tuple(
            LogLine(each.time, LEVELS.get(each.level, "info"), each.text)
            for each in self._log
            if each.time <= t or over
        )
        return Snapshot(
            seq=self._sequence,
            campaign=f"REPLAY {self.recording.attributes.get('campaign', '')}".strip(),
            state="done" if over else _state(step),
            thruster=self.recording.thruster,
            command=0.0 if self._command is None else _newest(self._command, t)[0] or 0.0,
            time=t,
            readings=tuple(_reading(channel, t) for channel in self._measured if channel.quantity),
            checks=(),
            points=tuple(point for ended, point in self._points if ended <= t),
            log=log[-NEWEST:],
            log_count=len(log),
            trace=self._trace(t),
            progress=self._progress(step, t),
            files=(self.path,),
            outcome=OUTCOMES.get(self.recording.outcome, "aborted") if over else "running",
            cause=self.recording.cause if over else "",
            attended=False,
            clients=0,
            since_begin=t,
            channels=self._channels(),
            replay=True,
        )

    def _step(self, t: float) -> Step | None:
        """The one under way; between two of them the one before."""
        return next((step for step in reversed(self._steps) if step.t_start <= t), None)

    def _progress(self, step: Step | None, t: float) -> Progress:
        steps = max((each.index for each in self._steps), default=-1) + 1
        length = max(self.end - self.begin, 1e-9)
        return Progress(
            step=max(step.index, 0) if step else 0,
            steps=steps,
            step_elapsed=max(t - step.t_start, 0.0) if step else 0.0,
            step_expected=step.t_end - step.t_start if step else 0.0,
            run=0,
            runs=1,
            elapsed=t - self.begin,
            eta=max(self.end - t, 0.0),
            fraction=min(max((t - self.begin) / length, 0.0), 1.0),
        )

    def _channels(self) -> tuple[TracedChannel, ...]:
        measured = (TracedChannel(f"{c.stream}.{c.name}", c.quantity or "", c.unit) for c in self._measured)
        return (TracedChannel("command", COMMAND, "V"), *measured)

    def _trace(self, t: float) -> tuple[TraceRow, ...]:
        """The tenths of a second that ended since it was asked last."""
        last = int(min(t, self.end) / TENTH)
        rows = tuple(self._row(n) for n in range(self._traced, last))
        self._traced = max(self._traced, last)
        return rows

    def _row(self, number: int) -> TraceRow:
        start, end = number * TENTH, (number + 1) * TENTH
        row = [(number + 0.5) * TENTH]
        row += _held(self._command, start, end)
        for channel in self._measured:
            row += _extremes(channel, start, end)
        return tuple(row)


def _state(step: Step | None) -> State:
    return STATES.get(step.phase, "free") if step is not None else "free"


def _newest(channel: Channel, t: float) -> tuple[float | None, float | None]:
    """(value, age) of the last row up to `t`; None: none, or the device gave nothing."""
    place = int(np.searchsorted(channel.time, t, side="right")) - 1
    if place < 0:
        return None, None
    value = float(channel.value[place])
    return (None if np.isnan(value) else value), t - float(channel.time[place])


def _reading(channel: Channel, t: float) -> Reading:
    value, age = _newest(channel, t)
    old = age is not None and age > STALE
    return Reading(
        f"{channel.stream}.{channel.name}", channel.quantity or "", channel.unit, value, age,
        state="none" if value is None else "stale" if old else "ok",
    )  # fmt: skip


def _extremes(channel: Channel, start: float, end: float) -> tuple[float, float]:
    first, last = np.searchsorted(channel.time, (start, end))
    values = channel.value[first:last]
    values = values[~np.isnan(values)]
    return (float(values.min()), float(values.max())) if values.size else (nan, nan)


def _held(command: Channel | None, start: float, end: float) -> tuple[float, float]:
    """A command has a row where it changes: between them it is the one before."""
    if command is None:
        return nan, nan
    before, _ = _newest(command, start)
    low, high = _extremes(command, start, end)
    known = [each for each in (before, low, high) if each is not None and not np.isnan(each)]
    return (min(known), max(known)) if known else (nan, nan)


def _points(recording: Recording) -> tuple[tuple[float, Point], ...]:
    """(s when it was there, point) of each hold, less the tare before it."""
    thrust = recording.first_of("thrust")
    if thrust is None:
        return ()
    tare, points = 0.0, []
    for step in sorted(recording.steps, key=lambda step: step.t_start):
        if step.phase == "tare":
            first, last = np.searchsorted(thrust.time, (step.t_start, step.t_end))
            tare = float(np.nanmean(thrust.value[first:last])) if last > first else tare
        elif step.phase == "hold" and (point := _point(recording, thrust, step, tare)) is not None:
            points.append((step.t_end, point))
    return tuple(points)


def _point(recording: Recording, thrust: Channel, step: Step, tare: float) -> Point | None:
    length = step.t_end - step.t_start
    first, last = np.searchsorted(thrust.time, (step.t_start + SETTLING * length, step.t_end))
    monitor = SteadyMonitor()
    monitor.add(thrust.time[first:last], thrust.value[first:last])
    found = monitor.estimate()
    if not np.isfinite(found.std_error):
        return None
    return Point(
        step.index, step.command_voltage, found.mean - tare, found.std_error, length,
        steady=True, thruster=recording.thruster, dof=found.dof,
    )  # fmt: skip
