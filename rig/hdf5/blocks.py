"""Reading one channel of a recording piece by piece: what `load` gives, for channels larger than memory."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from identification.recording import Channel, Floats
from rig.errors import RecordingError
from rig.hdf5.members import DAMAGE, LARGEST_VALUE, measured, members, numeric_columns
from rig.hdf5.opening import open_for_reading

BLOCK = 65_536
"""Rows read at a time: 0.5 MB per column, and one h5py call costs little beside it."""


class LongChannel:
    """A channel in an open file. Rows whose time is not finite or runs back get the time before them and NaN."""

    def __init__(self, group: h5py.Group, facts: Channel) -> None:
        columns = numeric_columns(group)
        self.facts = facts
        """The channel as `load` gives it, of whatever length."""
        self.rows = min(len(item) for item in columns.values())
        self._time, self._value = columns["time"], columns[facts.name]
        self._missing = self._value.attrs.get("missing_value")

    def values(self, start: int, stop: int) -> Floats:
        return measured(self._read(self._value, start, stop), self._missing)[0]

    def _read(self, column: h5py.Dataset, start: int, stop: int) -> NDArray[Any]:
        try:
            rows: NDArray[Any] = column[start:stop]
        except DAMAGE as error:
            raise RecordingError(f"{column.name} can't be read from row {start} on: {error}") from error
        return rows

    def times(self, start: int, stop: int, latest: float = -np.inf) -> tuple[Floats, Floats]:
        """Times, not before each other nor before `latest`; and as they are in the file."""
        found: Floats = self._read(self._time, start, stop).astype(np.float64, copy=False)
        rising: Floats = np.maximum.accumulate(np.where(np.abs(found) <= LARGEST_VALUE, found, -np.inf))
        return np.maximum(rising, latest), found

    def blocks(self) -> Iterator[tuple[Floats, Floats]]:
        """All rows in order, (time, value)."""
        latest = -np.inf
        for start in range(0, self.rows, BLOCK):
            stop = min(start + BLOCK, self.rows)
            time, found = self.times(start, stop, latest)
            value = self.values(start, stop)
            good = time == found
            if not good.all():
                value[~good] = np.nan
            latest = float(time[-1])
            yield time, value

    def place(self, time: float) -> int:
        """Number of rows at or before a time, by halving; right where time does not run back."""
        low, high = 0, self.rows
        while low < high:
            middle = (low + high) // 2
            low, high = (middle + 1, high) if self._time[middle] <= time else (low, middle)
        return low

    def around(self, first: float, last: float, start: int = 0) -> tuple[Channel, int]:
        """The rows that say what the channel is from `first` to `last`, s: two at or before, and on to a finite one.

        `start`: a row at or before them. Also returned: such a row for a later `first`.
        """
        times: list[Floats] = []
        stop = start
        while stop < self.rows and not (times and times[-1][-1] > last):
            latest = times[-1][-1] if times else -np.inf
            times.append(self.times(stop, min(stop + BLOCK, self.rows), latest)[0])
            stop = min(stop + BLOCK, self.rows)
        time = np.concatenate([*times, np.empty(0)])
        low = max(int(np.searchsorted(time, first, side="right")) - 2, 0)
        high = int(np.searchsorted(time, last, side="right"))
        value = self.values(start + low, stop)
        later = np.flatnonzero(np.isfinite(value[high - low :]))
        end = high - low + (int(later[0]) + 1 if later.size else 0)
        return self._piece(time[low : low + end], value[:end]), start + low

    def _piece(self, time: Floats, value: Floats) -> Channel:
        known = np.isfinite(time)
        facts = self.facts
        return Channel(facts.name, facts.stream, facts.quantity, facts.unit, time[known], value[known])


def _has(group: object, name: str) -> bool:
    return isinstance(group, h5py.Group) and {"time", name} <= set(numeric_columns(group))


@contextmanager
def long_channels(path: Path, *facts: Channel) -> Iterator[tuple[LongChannel, ...]]:
    """Channels of a recording, open for reading. Raises RecordingError."""
    file, _ = open_for_reading(path)
    with file:
        streams = dict(members(file["streams"]))
        missing = [f"{c.stream}/{c.name}" for c in facts if not _has(streams.get(c.stream), c.name)]
        if missing:
            raise RecordingError(f"{path} has no channel {', '.join(missing)}")
        yield tuple(LongChannel(file[f"streams/{channel.stream}"], channel) for channel in facts)
