"""Writing a recording. The layout is fixed before the first sample; then SWMR mode, and only rows are appended."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np
from numpy.typing import NDArray

from rig.errors import RecordingError
from rig.hdf5.layout import (
    CAUSE_BYTES,
    CHUNK_ROWS,
    EVENT_BYTES,
    EVENT_TYPE,
    FORMAT,
    FORMAT_VERSION,
    LIBVER,
    MISSING,
    OUTCOME_BYTES,
    PAGE_BYTES,
    STEP_TYPE,
    fixed,
    pieces,
)
from rig.link.recorder_messages import Attribute, ChannelSpec, EventRow, Rows, StepRow, StreamSpec

SET_BY_WRITER: Final = ("format", "format_version", "complete", "outcome")
CACHED_BYTES: Final = 64 * 1024
"""Of chunks in memory, for each column: nothing behind the chunk that grows is wanted again. HDF5's own 8 MiB fill up
over hours, a column after the other."""
CACHED_SLOTS: Final = 53
"""Of the table of a column's chunks in memory, a prime number."""


class Span:
    """Rows `start` to `start + n` of a dataset, in the file and in memory; columns of one stream share it."""

    def __init__(self, start: int, n: int) -> None:
        self.end = start + n
        self.memory = h5py.h5s.create_simple((n,))
        self.file = h5py.h5s.create_simple((self.end,), (h5py.h5s.UNLIMITED,))
        self.file.select_hyperslab((start,), (n,))


class Column:
    """One growing dataset; `append` is one HDF5 write, whatever its length."""

    def __init__(self, dataset: h5py.Dataset) -> None:
        self._id = dataset.id
        self._type = h5py.h5t.py_create(dataset.dtype)
        self.rows = 0

    def append(self, values: NDArray[Any], span: Span | None = None) -> None:
        """Low-level calls: the high-level `dataset[a:b] = ...` costs four times the time."""
        span = span or Span(self.rows, len(values))
        self._id.set_extent((span.end,))
        self._id.write(span.memory, span.file, values, self._type)
        self.rows = span.end


class StreamWriter:
    """Rows of one stream: gathered by `add`, written by `write`, time last, so that no time is without its values."""

    def __init__(self, group: h5py.Group, spec: StreamSpec, t0_ns: int) -> None:
        self.spec = spec
        self.dropped = 0
        """Rows whose time was before that of a row already there."""
        self._t0_ns = t0_ns
        self._latest = np.iinfo(np.int64).min
        self._waiting: list[Rows] = []
        facts = ("source", "device_id", "note", "period", "clock_drift_std")
        _attributes(group, {name: getattr(spec, name) for name in facts})
        self._channels = [Column(_channel(group, channel)) for channel in spec.channels]
        self._time = Column(_table(group, "time", np.dtype("<f8"), CHUNK_ROWS))
        group["time"].attrs.create("unit", "s")

    @property
    def rows(self) -> int:
        return self._time.rows

    def add(self, rows: Rows) -> None:
        if rows.values.shape != (len(rows.t_ns), len(self.spec.channels)):
            raise RecordingError(
                f"stream {self.spec.name} has {len(self.spec.channels)} channels, not rows of shape {rows.values.shape}"
            )
        if len(rows.t_ns):
            self._waiting.append(rows)

    def write(self) -> None:
        if not self._waiting:
            return
        t_ns, values = self._in_order(*_joined(self._waiting))
        self._waiting.clear()
        span = Span(self.rows, len(t_ns))
        for column, channel, value in zip(
            self._channels, self.spec.channels, np.ascontiguousarray(values.T), strict=True
        ):
            column.append(_counts(value) if channel.integer else value, span)
        self._time.append((t_ns - self._t0_ns) * 1e-9, span)

    def _in_order(self, t_ns: NDArray[np.int64], values: NDArray[np.float64]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Without the rows whose time was before that of a row already there, which are counted."""
        if t_ns[0] >= self._latest and not (t_ns[1:] < t_ns[:-1]).any():
            self._latest = int(t_ns[-1])
            return t_ns, values
        highest = np.maximum(np.maximum.accumulate(t_ns), self._latest)
        keep = t_ns >= highest
        self._latest = int(highest[-1])
        self.dropped += int(np.count_nonzero(~keep))
        return t_ns[keep], values[keep]


class RecordingFile:
    """One recording being written. Not closed in order, it still opens, with all that was flushed."""

    def __init__(
        self, path: Path, attributes: Mapping[str, Attribute], streams: Sequence[StreamSpec], t0_ns: int
    ) -> None:
        """Create the file with its whole layout. Raises RecordingError when it exists or can't be laid out."""
        _check_names(attributes, streams)
        try:
            self._file = h5py.File(
                path, "x", libver=LIBVER, fs_strategy="page", fs_page_size=PAGE_BYTES, rdcc_nbytes=CACHED_BYTES,
                rdcc_nslots=CACHED_SLOTS,
            )  # fmt: skip
        except OSError as error:
            raise RecordingError(f"{path}: cannot create the recording: {error}") from error
        self.path = path
        _attributes(self._file, {"format": FORMAT, "format_version": FORMAT_VERSION, "complete": False})
        self._file.attrs.create("outcome", fixed("running", OUTCOME_BYTES))
        _attributes(self._file, attributes)
        groups = self._file.create_group("streams", track_order=True)
        self.streams = [StreamWriter(groups.create_group(spec.name, track_order=True), spec, t0_ns) for spec in streams]
        self._steps = Column(_table(self._file, "steps", STEP_TYPE, 64))
        self._events = Column(_table(self._file, "events", EVENT_TYPE, 64))
        end = self._file.create_group("end")
        end.create_dataset("complete", data=np.array([False]))
        end.create_dataset("outcome", data=fixed("running", OUTCOME_BYTES).reshape(1))
        end.create_dataset("cause", data=fixed("", CAUSE_BYTES).reshape(1))
        self._file.swmr_mode = True
        self._waiting_steps: list[StepRow] = []
        self._waiting_events: list[EventRow] = []

    def add_rows(self, rows: Rows) -> None:
        """Keep rows for the next flush. Rows older than the last of their stream are dropped and counted."""
        if not rows.stream < len(self.streams):
            raise RecordingError(f"{self.path}: rows came for stream {rows.stream} of {len(self.streams)}")
        self.streams[rows.stream].add(rows)

    def add_step(self, step: StepRow) -> None:
        self._waiting_steps.append(step)

    def add_event(self, event: EventRow) -> None:
        self._waiting_events.append(event)

    def flush(self) -> tuple[int, ...]:
        """Everything added so far onto the disk (fsync, for power cuts). Returns rows per stream."""
        for stream in self.streams:
            stream.write()
        if self._waiting_steps:
            self._steps.append(_step_rows(self._waiting_steps))
            self._waiting_steps.clear()
        if self._waiting_events:
            self._events.append(_event_rows(self._waiting_events))
            self._waiting_events.clear()
        self._file.flush()
        os.fsync(self._file.id.get_vfd_handle())
        return tuple(stream.rows for stream in self.streams)

    def close(self, outcome: str, cause: str, time: float) -> None:
        """Write what waits, /end and the root attributes, then close. `time` in s since t0 stamps the last events."""
        for stream in self.streams:
            stream.write()
        for stream in self.streams:
            if stream.dropped:
                text = f"{stream.spec.name}: {stream.dropped} rows dropped, older than the row before them"
                self.add_event(EventRow(time, "warning", text))
        self.flush()
        end = self._file["end"]
        end["cause"][0] = fixed(cause, CAUSE_BYTES)
        end["outcome"][0] = fixed(outcome, OUTCOME_BYTES)
        end["complete"][0] = True
        h5py.h5a.open(self._file.id, b"outcome").write(fixed(outcome, OUTCOME_BYTES))
        h5py.h5a.open(self._file.id, b"complete").write(np.array(True))
        self.flush()
        self._file.close()


def _check_names(attributes: Mapping[str, Attribute], streams: Sequence[StreamSpec]) -> None:
    wrong = [name for name in attributes if name in SET_BY_WRITER]
    names = [stream.name for stream in streams]
    wrong += [name for name in names if names.count(name) > 1 or not name or "/" in name]
    for stream in streams:
        inner = [channel.name for channel in stream.channels]
        wrong += [name for name in inner if inner.count(name) > 1 or name == "time" or not name or "/" in name]
        for channel in stream.channels:
            if channel.calibration:
                _check_calibration(f"{stream.name}/{channel.name}", channel.calibration)
    if wrong:
        raise RecordingError(f"names taken, empty, doubled or with a slash: {', '.join(map(repr, wrong))}")


def _check_calibration(channel: str, calibration: str) -> None:
    try:
        content = json.loads(calibration)
    except json.JSONDecodeError as error:
        raise RecordingError(f"calibration of {channel} is not JSON: {error}") from error
    if not isinstance(content, dict):
        raise RecordingError(f"calibration of {channel} must be a JSON object, got {calibration[:60]}")


def _attributes(target: h5py.Group | h5py.Dataset, attributes: Mapping[str, Attribute | None]) -> None:
    """Those that say something. Text is variable-length, which h5py and MATLAB read as text; it is on the disk before
    the first row and never touched again: a kill can't hurt it as it can tables.
    """
    for name, value in attributes.items():
        if value is not None and value != "":
            target.attrs.create(name, value)


def _table(group: h5py.Group, name: str, dtype: np.dtype[Any], chunk: int) -> h5py.Dataset:
    return group.create_dataset(name, (0,), dtype=dtype, maxshape=(None,), chunks=(chunk,))


def _channel(group: h5py.Group, spec: ChannelSpec) -> h5py.Dataset:
    dataset = _table(group, spec.name, np.dtype("<i8" if spec.integer else "<f8"), CHUNK_ROWS)
    facts: dict[str, Attribute | None] = {
        name: getattr(spec, name) for name in ("quantity", "unit", "noise_std", "range_min", "range_max")
    }
    facts |= {name: getattr(spec, name) for name in ("quantum", "rounding", "delay", "delay_std")}
    facts |= {name: getattr(spec, name) for name in ("window", "low_pass", "filter")}
    facts |= {name: getattr(spec, name) for name in ("calibration", "thruster", "axis", "description")}
    if spec.integer:
        facts["missing_value"] = MISSING
    _attributes(dataset, facts)
    return dataset


def _joined(waiting: Sequence[Rows]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    if len(waiting) == 1:
        return waiting[0].t_ns, waiting[0].values
    return np.concatenate([rows.t_ns for rows in waiting]), np.concatenate([rows.values for rows in waiting])


def _counts(values: NDArray[np.float64]) -> NDArray[np.int64]:
    out = np.full(values.shape, MISSING, dtype=np.int64)
    given = np.isfinite(values)
    out[given] = np.rint(values[given]).astype(np.int64)
    return out


def _step_rows(steps: Sequence[StepRow]) -> NDArray[Any]:
    rows = [(s.index, pieces(s.phase, 8)[0], s.command_voltage, s.t_start, s.t_end) for s in steps]
    return np.array(rows, dtype=STEP_TYPE)


def _event_rows(events: Sequence[EventRow]) -> NDArray[Any]:
    rows = [(e.time, pieces(e.level, 8)[0], piece) for e in events for piece in pieces(e.text, EVENT_BYTES)]
    return np.array(rows, dtype=EVENT_TYPE)
