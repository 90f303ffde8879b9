"""What stands before the rows of a recording, many recordings at a time: for a catalogue of thousands.

`load(path, rows=0)` reads every attribute of every channel (25 ms of a processor for a file of eight channels), in a
child for each file (nearly as long again). Here the few that a list shows are read, of many files in one child. The
child has the limits of decision 14, and each of its files is closed to links as there; when it dies, each file of its
batch gets a child of its own, so that the one to blame is named and the others are read.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import tee
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

import h5py
import numpy as np
from h5py import h5a, h5d, h5f, h5g, h5l, h5s

from identification.recording import QUANTITY_UNITS
from rig.errors import RecordingError
from rig.hdf5.apart import all_apart, apart, open_again, open_no_more
from rig.hdf5.layout import text_of
from rig.hdf5.members import DAMAGE, LARGEST_VALUE, is_column
from rig.hdf5.opening import open_for_reading, require_file

T = TypeVar("T")

ROOT: Final = (
    "recording_id", "thruster", "kind", "created", "campaign", "operator", "facility", "attempt", "continues",
    "bench_toml",
)  # fmt: skip
"""Attributes of the file that a header has, as texts."""
LONGEST: Final = 2**20
"""Bytes of an attribute; a bench file has some thousands."""


class ChannelHeader(NamedTuple):
    """One channel, without its rows."""

    name: str
    quantity: str
    unit: str
    calibration: str
    """JSON text, as it stands in the file; of thrust channels only."""


class StreamHeader(NamedTuple):
    """One stream; its times are those of the first and the last row, s, None where there is no row."""

    name: str
    channels: tuple[ChannelHeader, ...]
    rows: int
    first: float | None
    last: float | None


class Header(NamedTuple):
    """What a recording says of itself."""

    texts: Mapping[str, str]
    """Root attributes by name, empty where absent."""
    complete: bool
    outcome: str
    cause: str
    opened_as: str
    """`plain`, or `swmr`: not closed in order, or still being written."""
    streams: tuple[StreamHeader, ...]

    @property
    def duration(self) -> float | None:
        """Seconds from the first to the last row of any stream."""
        spans = [(s.first, s.last) for s in self.streams if s.first is not None and s.last is not None]
        return max(last for _, last in spans) - min(first for first, _ in spans) if spans else None


def headers(paths: Sequence[Path]) -> list[Header | RecordingError]:
    """Of each path its header, or why it has none. Raises nothing for what a file holds."""
    return next(headers_in_batches([paths]))


def headers_in_batches(batches: Iterable[Sequence[Path]]) -> Iterator[list[Header | RecordingError]]:
    """The same of each batch in order, a child for each, as many at a time as there are processors."""
    ours, theirs = tee(batches)
    for paths, found in zip(theirs, all_apart((partial(_all_tried, paths), paths) for paths in ours), strict=True):
        if isinstance(found, RecordingError):  # one of them ended the child, or asked too much of it
            yield [_alone(path) for path in paths]
        else:
            yield found


def _all_tried(paths: Sequence[Path]) -> list[Header | RecordingError]:
    return [_tried(path) for path in paths]


def _tried(path: Path) -> Header | RecordingError:
    try:
        require_file(path)
        open_again()
        return _header(path)
    except RecordingError as error:
        return error
    except DAMAGE as error:
        if isinstance(error, MemoryError):
            raise
        return RecordingError(f"{path} is damaged: {error}")


def _alone(path: Path) -> Header | RecordingError:
    try:
        require_file(path)
        return apart(lambda: _tried(path), path)
    except RecordingError as error:
        return error
    except OSError as error:
        return RecordingError(f"{path} can't be read: {error.strerror}")


def _header(path: Path) -> Header:
    file, opened_as = open_for_reading(path)
    open_no_more()
    with file:
        streams = h5g.open(file.id, b"streams")
        found = tuple(_stream(streams, name) for name in _members(streams))
        if not any(stream.channels for stream in found):
            raise RecordingError(f"{path} says it is a recording, but no stream in it has a time and a channel")
        texts = {name: _text(file.id, name) for name in ROOT}
        complete, outcome, cause = (_end(file.id, name) for name in ("complete", "outcome", "cause"))
        return Header(texts, _is_true(complete), outcome, cause, opened_as, found)


def _end(file: h5f.FileID, name: str) -> str:
    """/end is believed before the root attribute."""
    with suppress(*DAMAGE):
        item = h5d.open(file, f"end/{name}".encode())
        if item.get_space().get_simple_extent_npoints() == 1:
            value = np.empty(item.shape, item.dtype)
            item.read(h5s.ALL, h5s.ALL, value)
            return text_of(value)
    return _text(file, name)


def _is_true(text: str) -> bool:
    """Of a truth or a number, as texts."""
    try:
        return text == "True" or bool(float(text))
    except ValueError:
        return False


def _members(group: h5g.GroupID) -> list[bytes]:
    """Names of what the group itself holds, and does not only point to."""
    return [name for name in group if group.links.get_info(name).type == h5l.TYPE_HARD]


def _stream(streams: h5g.GroupID, name: bytes) -> StreamHeader:
    shown = name.decode("utf-8", "replace")
    try:
        group = h5g.open(streams, name)
        members = _members(group)
        time = h5py.Dataset(h5d.open(group, b"time")) if b"time" in members else None
    except DAMAGE:
        return StreamHeader(shown, (), 0, None, None)
    if time is None or not is_column(time):
        return StreamHeader(shown, (), 0, None, None)
    channels = [_channel(group, each) for each in members if each != b"time"]
    return StreamHeader(shown, tuple(channels), len(time), *_ends(time.id))


def _channel(group: h5g.GroupID, name: bytes) -> ChannelHeader:
    quantity = _text(group, "quantity", name)
    unit = _text(group, "unit", name) or QUANTITY_UNITS.get(quantity, ("",))[0]
    calibration = _text(group, "calibration", name) if quantity == "thrust" else ""
    return ChannelHeader(name.decode("utf-8", "replace"), quantity, unit, calibration)


def _ends(time: h5d.DatasetID) -> tuple[float | None, float | None]:
    """The first and the last row of a column; None where there is none that can be a time."""
    with suppress(*DAMAGE):
        rows, space = time.shape[0], time.get_space()
        count = min(rows, 2)
        space.select_hyperslab((0,), (count,), (max(rows - 1, 1),))
        found = np.empty(count)
        time.read(h5s.create_simple((count,)), space, found)
        first, last = (float(value) if abs(value) <= LARGEST_VALUE else None for value in (found[0], found[-1]))
        return first, last
    return None, None


def _text(item: Any, name: str, of: bytes = b".") -> str:
    """An attribute of a member; empty where there is none that can be read. Low-level: `attrs` costs three times as
    much, and to open the member as much again."""
    key = name.encode()
    with suppress(*DAMAGE):
        if h5a.exists(item, key, obj_name=of):
            attribute = h5a.open(item, key, obj_name=of)
            if attribute.get_storage_size() <= LONGEST:
                value = np.empty(attribute.shape, attribute.dtype)
                attribute.read(value)
                return text_of(value)
    return ""
