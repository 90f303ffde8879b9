"""Does the thrust lead or lag its command by a part of a level? Then levels are fitted with thrust that is another's.

A table of levels whose command and means stand at one time has each level begin where it is half over. In a log the
clocks of command and cell may differ: the thrust of each level is steadiest when the holds are shifted by as much.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

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
    scatter, follows = _within(_Sums.of(windows, time, value), shifts)
    steady = scatter <= AS_STEADY * float(scatter.min())
    best = int(np.argmax(np.where(steady, follows, -np.inf)))
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


def _within(sums: _Sums, shifts: Floats) -> tuple[Floats, Floats]:
    """(S,) each, of levels shifted by `shifts` s: N^2, variance of the samples about the mean of their level; and the
    correlation of those means with V|V|. Thrust of the level before is as steady, but does not follow this command."""
    low, high = (np.searchsorted(sums.time, edge + shifts[:, None]) for edge in (sums.begin, sums.end))
    some = high - low >= LEAST_SAMPLES
    count = np.where(some, high - low, 1)
    total = sums.once[high] - sums.once[low]
    scatter = np.sum(sums.squared[high] - sums.squared[low] - total**2 / count, axis=1, where=some)
    means, drivers = total / count, np.broadcast_to(sums.driver, some.shape)
    told = (np.count_nonzero(some, axis=1) >= 3) & _moves(means, some) & _moves(drivers, some)
    mean, driver = _beside_mean(means, some), _beside_mean(drivers, some)
    sizes = np.sum(mean**2, axis=1) * np.sum(driver**2, axis=1)
    samples = np.maximum(np.sum(count - 1, axis=1, where=some), 1)
    follows = np.abs(np.sum(mean * driver, axis=1)) / np.sqrt(np.where(told, sizes, 1.0))
    return np.where(told, np.maximum(scatter, 0.0) / samples, np.inf), np.where(told, follows, 0.0)


def _moves(x: Floats, some: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Of each row of `x`, whether what is `some` differs."""
    highest, lowest = np.max(x, axis=1, where=some, initial=-np.inf), np.min(x, axis=1, where=some, initial=np.inf)
    return np.asarray(highest > lowest, dtype=np.bool_)


def _beside_mean(x: Floats, some: NDArray[np.bool_]) -> Floats:
    """Each row of `x` less the mean of what is `some`, and 0 where it is not."""
    mean = np.sum(x, axis=1, where=some) / np.maximum(np.count_nonzero(some, axis=1), 1)
    return np.where(some, x - mean[:, None], 0.0)
