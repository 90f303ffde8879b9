"""Reading one stream of a recording piece by piece, its channels beside one another: the rows that `load` gives, of a
recording that may be larger than memory.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from identification.recording import Channel, Floats
from rig.errors import RecordingError
from rig.hdf5.apart import apart, open_no_more
from rig.hdf5.members import DAMAGE, LARGEST_VALUE, measured, members, numeric_columns
from rig.hdf5.opening import open_for_reading

ROWS_AT_A_TIME = 2**18
"""2 MB per column; a child that reads them takes some 20 ms to come and go."""


@dataclass(frozen=True, slots=True)
class Piece:
    """Some rows: `time` (n,) in s, and the values (n,) of each channel in its unit, NaN where it gave nothing."""

    time: Floats
    values: tuple[Floats, ...]
    left_out: int
    """Rows whose time is not finite or runs back."""
    last: bool
    """Nothing comes after them."""


@dataclass
class StreamRows:
    """The rows of some channels of one stream, read by `pieces`, and how many there were."""

    path: Path
    channels: tuple[Channel, ...]
    """As `load` gives them, of whatever length, at least one."""
    kept: int = field(default=0, init=False)
    left_out: int = field(default=0, init=False)
    """Rows whose time is not finite or runs back."""

    def pieces(self) -> Iterator[tuple[Floats, ...]]:
        """Time and then each channel, some rows at a time, each piece read apart. Raises RecordingError."""
        start, latest, more = 0, -np.inf, True
        while more:
            piece = apart(partial(_read, self.path, self.channels, start, latest), self.path)
            start, more = start + ROWS_AT_A_TIME, not piece.last
            self.kept += piece.time.size
            self.left_out += piece.left_out
            if piece.time.size:
                latest = float(piece.time[-1])
                yield piece.time, *piece.values


def _read(path: Path, channels: tuple[Channel, ...], start: int, latest: float) -> Piece:
    file, _ = open_for_reading(path)
    open_no_more()
    stream = channels[0].stream
    with file:
        try:
            columns = numeric_columns(dict(members(file["streams"]))[stream])
            rows = min(len(column) for column in columns.values())
            stop = min(start + ROWS_AT_A_TIME, rows)
            found = columns["time"][start:stop].astype(np.float64)
            finite = np.abs(found) <= LARGEST_VALUE
            good = finite & (found >= np.maximum.accumulate(np.where(finite, found, -np.inf))) & (found >= latest)
            read = [columns[channel.name] for channel in channels]
            values = tuple(measured(c[start:stop], c.attrs.get("missing_value"))[0][good] for c in read)
        except DAMAGE as error:
            raise RecordingError(
                f"{path}: stream {stream} can't be read from row {start} on: {error}; the others can: --streams"
            ) from error
    return Piece(found[good], values, int(np.count_nonzero(~good)), stop >= rows)
