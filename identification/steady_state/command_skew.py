"""Does the thrust lead or lag its command by a part of a level? Then levels are fitted with thrust that is another's.

A table of levels whose command and means stand at one time has each level begin where it is half over. In a log the
clocks of command and cell may differ: the thrust of each level is steadiest when the holds are shifted by as much.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from identification.recording import Channel, Floats, Recording
from identification.steady_state.holds import Window
from identification.steady_state.points import find_windows

LEAST_SHARE: Final = 0.15
"""Of a level: a smaller shift is left to the settling of rotor and water, which a fit leaves out."""
FEW: Final = 2
"""Thrust samples of a level of a table, at most."""
AT_ITS_EDGE: Final = 0.1
"""Of a level: a mean that stands so near to an edge was not put into the middle."""
LEAST_LEVEL: Final = 0.5
"""s: commands that change faster are no levels."""
LEAST_SAMPLES: Final = 8
"""Of a level of a log."""
STEADIER: Final = 2.0
"""Times by which the variance within levels must fall with the shift."""
SHIFTS: Final = 41
"""Tried on either side, up to one level."""


@dataclass(frozen=True, slots=True)
class CommandSkew:
    """`seconds` that the thrust comes after its command; negative: before it."""

    seconds: float
    level: float
    """s, median length of a level."""
    table: bool
    """Told by where the one sample of each level stands; else by the course of the thrust."""

    @property
    def share(self) -> float:
        """Of a level."""
        return abs(self.seconds) / self.level

    @property
    def statement(self) -> str:
        """With the number and what to do."""
        way = "lags" if self.seconds > 0 else "leads"
        head = f"thrust {way} its command by {abs(self.seconds):.3g} s, {100 * self.share:.0f} % of a level"
        if self.table:
            return (
                f"{head}: each level has one thrust sample, at its edge and not in its middle; if a row of the table "
                "is a level, import it again with [time] levels = true in the map (--levels middle), or level_duration"
            )
        return (
            f"{head}: the clocks of command and cell differ, or what turns is that slow; compare the clocks and import "
            f"the slower file with its offset (--offset), or leave out more of each level"
        )


def command_skew(recording: Recording) -> CommandSkew | None:
    """A shift of a part of a level between command and thrust, None where there is none to see."""
    command, thrust = recording.first_of("command_voltage"), recording.first_of("thrust")
    if command is None or thrust is None:
        return None
    good = np.isfinite(thrust.value)
    time, value = thrust.time[good], thrust.value[good]
    return _of_table(command, time) or _of_log(find_windows(recording, command, thrust), time, value)


def _of_table(command: Channel, time: Floats) -> CommandSkew | None:
    moved = np.flatnonzero(np.diff(command.value, prepend=np.nan) != 0)
    begins = command.time[moved]
    if begins.size < 3 or time.size < 3:
        return None
    length = np.diff(begins)
    level = float(np.median(length))
    count = np.diff(np.searchsorted(time, begins))
    if level < LEAST_LEVEL or float(np.mean((count > 0) & (count <= FEW))) < 0.9:
        return None
    place = np.searchsorted(begins, time, side="right") - 1
    inside = (place >= 0) & (place < length.size)
    where = float(np.median((time[inside] - begins[place[inside]]) / length[place[inside]]))
    if AT_ITS_EDGE < where < 1 - AT_ITS_EDGE:
        return None
    return CommandSkew((where - 0.5) * level, level, table=True)


def _of_log(windows: tuple[Window, ...], time: Floats, value: Floats) -> CommandSkew | None:
    """The shift at which the thrust varies least within the levels."""
    if len({w.voltage for w in windows}) < 3:
        return None
    level = float(np.median([w.t_end - w.t_start for w in windows]))
    if level < LEAST_LEVEL or time.size < LEAST_SAMPLES * len(windows):
        return None
    shifts = level * np.linspace(-1.0, 1.0, 2 * SHIFTS + 1)
    scatter = np.array([_within(windows, time, value, shift) for shift in shifts.tolist()])
    best, now = int(np.argmin(scatter)), scatter[SHIFTS]
    found = CommandSkew(float(shifts[best]), level, table=False)
    return found if found.share >= LEAST_SHARE and now > STEADIER * scatter[best] else None


def _within(windows: tuple[Window, ...], time: Floats, value: Floats, shift: float) -> float:
    """N^2, variance of the samples about the mean of their level, levels shifted by `shift` s; of whole levels only."""
    total, count = 0.0, 0
    for w in windows:
        low, high = np.searchsorted(time, (w.t_start + shift, w.t_end + shift))
        part = value[low:high]
        if part.size >= LEAST_SAMPLES:
            total, count = total + float(np.sum((part - part.mean()) ** 2)), count + part.size - 1
    return total / count if count else float("inf")
