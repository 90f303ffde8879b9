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
FEW: Final = 7
"""Thrust samples of a level of a table, at most; a log has more (points.py)."""
AT_ITS_EDGE: Final = 0.1
"""Of a row: a mean that stands so near to the edge of its level was not put into the middle of its row."""
LEAST_LEVEL: Final = 0.5
"""s: commands that change faster are no levels."""
LEAST_SAMPLES: Final = 8
"""Of a level of a log."""
SLOW: Final = 0.5
"""s: rotor and water of a sound thruster lag their command by less (motors 0.05 to 0.3 s, inflow 0.1 to 0.5 s); only
what lags more may be a clock."""
STEADIER: Final = 2.0
"""Times by which the variance within levels must fall with the shift."""
AS_STEADY: Final = 1.5
"""Times the least variance: shifts within it are told apart by whether the levels then follow their command."""
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
                f"{head}: the few thrust samples of each level begin or end at its very edge; if a row of the table "
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
    level, row = float(np.median(np.diff(begins))), float(np.median(np.diff(time)))
    edges = np.searchsorted(time, begins)
    count = np.diff(edges)
    if min(level, row) < LEAST_LEVEL or float(np.mean((count > 0) & (count <= FEW))) < 0.9:
        return None
    held = [
        (time[a:b] - t) / (u - t) for a, b, t, u in zip(edges, edges[1:], begins, begins[1:], strict=False) if b > a
    ]
    off = float(np.median([part.mean() for part in held])) - 0.5
    nearest = float(np.median([min(part[0], 1 - part[-1]) for part in held]))  # of a level, from its edge
    if nearest * level > AT_ITS_EDGE * min(row, level) or abs(off) < LEAST_SHARE:
        return None
    return CommandSkew(off * level, level, table=True)


def _of_log(windows: tuple[Window, ...], time: Floats, value: Floats) -> CommandSkew | None:
    """The shift at which the thrust varies least within the levels."""
    if len({w.voltage for w in windows}) < 3:
        return None
    level = float(np.median([w.t_end - w.t_start for w in windows]))
    if level < LEAST_LEVEL or time.size < LEAST_SAMPLES * len(windows):
        return None
    shifts = level * np.linspace(-1.0, 1.0, 2 * SHIFTS + 1)
    sums = _Sums.of(windows, time, value)
    tried = [_within(sums, shift) for shift in shifts.tolist()]
    scatter = np.array([variance for variance, _ in tried])
    steady = scatter <= AS_STEADY * float(scatter.min())
    best = int(np.argmax(np.where(steady, [follows for _, follows in tried], -np.inf)))
    found, now = CommandSkew(float(shifts[best]), level, table=False), scatter[SHIFTS]
    if found.share < LEAST_SHARE or 0 < found.seconds < SLOW:
        return None
    return found if now > STEADIER * scatter[best] else None


@dataclass(frozen=True, eq=False, slots=True)
class _Sums:
    """Samples and the sums of their values up to each, and the levels that are shifted over them."""

    time: Floats
    once: Floats
    squared: Floats
    begin: Floats
    end: Floats
    driver: Floats
    """V|V| of each level."""

    @classmethod
    def of(cls, windows: tuple[Window, ...], time: Floats, value: Floats) -> _Sums:
        left = value - value.mean()  # so that the sums lose no digits
        begin, end, V = np.array([(w.t_start, w.t_end, w.voltage) for w in windows]).T
        return cls(time, _summed(left), _summed(left**2), begin, end, V * np.abs(V))


def _summed(value: Floats) -> Floats:
    return np.concatenate(([0.0], np.cumsum(value)))


def _within(sums: _Sums, shift: float) -> tuple[float, float]:
    """N^2, variance of the samples about the mean of their level, levels shifted by `shift` s; and the correlation of
    those means with V|V|: thrust of the level before is as steady, but it does not follow this command."""
    low, high = np.searchsorted(sums.time, sums.begin + shift), np.searchsorted(sums.time, sums.end + shift)
    some = high - low >= LEAST_SAMPLES
    low, high, driver = low[some], high[some], sums.driver[some]
    count = high - low
    total = sums.once[high] - sums.once[low]
    if count.size < 3 or not np.ptp(total / count) or not np.ptp(driver):
        return float("inf"), 0.0
    scatter = float(np.sum(sums.squared[high] - sums.squared[low] - total**2 / count))
    return max(scatter, 0.0) / float(np.sum(count - 1)), abs(float(np.corrcoef(total / count, driver)[0, 1]))
