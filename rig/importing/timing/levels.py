"""Is a row of a table one level and what was measured on it, or one sample of a log? And when does its level begin?

A level's command stands at its start and its measured values in its middle. Were both put at one time, a reader would
take the command to begin where half of the level is over, and half of each measured mean to belong to the level before.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from identification.recording import Floats
from rig.errors import RecordingError
from rig.importing.mapping import Time

LOG_SPACING: Final = 0.5
"""s: rows nearer than this are samples of a log; a stand needs longer to come to rest on a level than that (rotors and
the water about them settle in some tenths of a second, /docs/howto/fit.md)."""
LOG_ROWS: Final = 8
"""Rows with one command, the usual number (median), from which on they are a log's; a fit makes no hold of fewer
(identification.steady_state.points.MIN_HOLD_SAMPLES), and three rows may be one level measured three times."""
EACH: Final = 0.5
"""More than this share of the rows has another command than the row before: a row, a level."""
JUMP: Final = 0.2
"""Of the command's range: rows that differ by this much from one to the next (median), and in no even course (a second
difference is as large as a first), are no samples of a command that moves."""
LEAST_ROWS: Final = 4
"""Fewer rows have no course to be told."""
SAME: Final = 1e-6
"""Of the command's range: a smaller difference is none."""


@dataclass(frozen=True, slots=True)
class Rows:
    """What the rows of a file are, and how that is known."""

    levels: bool
    because: str


@dataclass(frozen=True, eq=False)
class LevelTimes:
    """s on the file's clock, (n,) each."""

    start: Floats
    middle: Floats
    end: Floats


def rows_are(clock: Time, time: Floats, command: Floats | None, *, vehicle: bool) -> Rows:
    """Levels or samples, of rows at `time` (n,) s with `command` (n,), None where the file has none.

    Raises RecordingError, which names the key, where the rows do not tell.
    """
    if clock.level_duration is not None:
        return Rows(True, f"[time] level_duration = {clock.level_duration:g}")
    if clock.levels is not None:
        return Rows(clock.levels, f"[time] levels = {'true' if clock.levels else 'false'}")
    if command is None or vehicle:
        return Rows(False, "a vehicle's log" if vehicle else "no command in it")
    given = np.isfinite(command)
    time, command = time[given], command[given]
    size = float(np.ptp(command)) if command.size else 0.0
    if command.size < 2 or size == 0:
        return Rows(False, "the command never changes")
    return _told(time, command, size)


def _told(time: Floats, command: Floats, size: float) -> Rows:
    moved = np.abs(np.diff(command))
    share, spacing = float(np.mean(moved > SAME * size)), float(np.median(np.diff(time)))
    if spacing < LOG_SPACING:
        return Rows(False, f"rows {spacing:.3g} s apart")
    begins = np.flatnonzero(np.append(True, moved > SAME * size))
    usual = float(np.median(np.diff(np.append(begins, command.size))))
    if usual >= LOG_ROWS:
        return Rows(False, f"{usual:.0f} rows with one command")
    course = command.size < LEAST_ROWS or float(np.median(np.abs(np.diff(command, 2)))) < float(np.median(moved))
    if share > EACH and not course and float(np.median(moved)) >= JUMP * size:
        return Rows(True, f"rows {spacing:.3g} s apart and the command jumps from each to the next")
    raise RecordingError(
        f"{command.size} rows {spacing:.3g} s apart, {100 * share:.0f} % of them with another command than the row "
        "before: a table of levels (a row is a level and the means measured on it), or a log (a row is a sample)? "
        "Say it in the map, [time] levels = true or levels = false (or --levels middle, start, end or no: what of its "
        "level the time of a row is)"
    )


def level_times(clock: Time, time: Floats) -> LevelTimes:
    """Of each row, from the times (n,) of a column or a rate, or from the stated length of a level.

    >>> from rig.importing.mapping import Time
    >>> found = level_times(Time(column="t"), np.array([2.0, 6.0, 10.0]))
    >>> found.start.tolist(), found.middle.tolist(), found.end.tolist()
    ([0.0, 4.0, 8.0], [2.0, 6.0, 10.0], [4.0, 8.0, 12.0])
    """
    if clock.level_duration is not None:
        return LevelTimes(time, time + 0.5 * clock.level_duration, time + clock.level_duration)
    if time.size < 2:
        raise RecordingError("a table of one level does not tell how long it was held; give [time] level_duration")
    step = np.diff(time)
    if not np.all(step > 0):
        raise RecordingError("two levels have the same time; a table of levels needs times that rise")
    if clock.level_time == "start":
        start, end = time, np.append(time[1:], time[-1] + step[-1])
    elif clock.level_time == "end":
        start, end = np.append(time[0] - step[0], time[:-1]), time
    else:
        between = time[:-1] + 0.5 * step
        start, end = np.append(time[0] - 0.5 * step[0], between), np.append(between, time[-1] + 0.5 * step[-1])
    middle = time if clock.level_time == "middle" else 0.5 * (start + end)
    return LevelTimes(start, middle, end)
