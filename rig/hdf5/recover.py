"""Saving a recording whose writer was killed: a plain copy, and the loss stated in samples."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from rig.errors import RecordingError
from rig.hdf5.apart import apart, open_no_more
from rig.hdf5.layout import CAUSE_BYTES, EVENT_TYPE, FLUSH_PERIOD, OUTCOME_BYTES, fixed, text_of
from rig.hdf5.members import DAMAGE, attributes, members, numeric_columns, table
from rig.hdf5.opening import open_for_reading, require_file


@dataclass(frozen=True, slots=True)
class Loss:
    """What one stream has kept and lost."""

    stream: str
    kept: int
    """Rows in the copy."""
    unfinished: int
    """Rows that had a value in some channels only: not copied."""
    unflushed: int
    """At most so many more had come after the last flush, by the stream's own mean rate; no file has them."""


def recover(path: str | Path, out: str | Path, end: tuple[str, str] = ("aborted", "")) -> tuple[Loss, ...]:
    """Copy a recording that was not closed in order into a plain file `out`, a new one. Raises RecordingError.

    The writer must have ended. The copy keeps id, steps, events and everything unknown; it stays `complete = false`.
    `end`: outcome and cause, where somebody else knows how the run ended.
    """
    path, out = Path(path), Path(out)
    if out.exists():
        raise RecordingError(f"{out} exists; a recording is never overwritten: give another name")
    require_file(path)
    part = out.with_name(out.name + ".part")
    try:
        losses = apart(lambda: _recover(path, part, end), path)
    except RecordingError:
        part.unlink(missing_ok=True)
        raise
    part.rename(out)
    return losses


def _recover(path: Path, part: Path, end: tuple[str, str]) -> tuple[Loss, ...]:
    source, opened_as = open_for_reading(path)
    with source:
        if opened_as == "plain":
            raise RecordingError(f"{path} opens as it is; there is nothing to recover")
        lost: list[str] = []
        try:
            with h5py.File(part, "w") as target:
                open_no_more()
                losses = _copy(source, target, lost)
                _mark(source, target, path, end, [*lost, *(sentence(loss) for loss in losses)])
        except DAMAGE as error:
            raise RecordingError(f"{path} is damaged beyond recovery: {error}") from error
    return losses


def _copy(source: h5py.File, target: h5py.File, lost: list[str]) -> tuple[Loss, ...]:
    """What can't be read is named in `lost`."""
    _copy_attributes(source, target, lost)
    for name, item in members(source):
        if name in ("streams", "events"):
            continue
        try:
            source.copy(item, target, name=name)
        except DAMAGE as error:
            lost.append(f"/{name} can't be read: {error}")
    streams = target.create_group("streams", track_order=True)
    _copy_attributes(source["streams"], streams, lost)
    groups = [(name, item) for name, item in members(source["streams"]) if isinstance(item, h5py.Group) and len(item)]
    return tuple(_copy_stream(name, group, streams, lost) for name, group in groups)


def _copy_stream(name: str, source: h5py.Group, streams: h5py.Group, lost: list[str]) -> Loss:
    target = streams.create_group(name, track_order=True)
    _copy_attributes(source, target, lost)
    columns = numeric_columns(source)
    lost += [f"{name}/{column} can't be read" for column in source if column not in columns]
    lengths = [len(item) for item in columns.values()] or [0]
    n = min(lengths)
    for column, item in columns.items():
        try:
            values = item[:n]
        except DAMAGE as error:
            lost.append(f"{name}/{column} can't be read: {error}")
            continue
        _copy_attributes(item, target.create_dataset(column, data=values), lost)
    return Loss(name, n, max(lengths) - n, _unflushed(columns, n))


def _unflushed(columns: dict[str, h5py.Dataset], n: int) -> int:
    if "time" not in columns or n < 2:
        return 0
    first, last = (float(columns["time"][row]) for row in (0, n - 1))
    rows = 2 * FLUSH_PERIOD * (n - 1) / (last - first) if last > first else 0.0
    return math.ceil(rows) if math.isfinite(rows) else 0


def _copy_attributes(source: Any, target: Any, lost: list[str]) -> None:
    for name, value in attributes(source, lost).items():
        target.attrs.create(name, value, dtype=source.attrs.get_id(name).dtype)


def _mark(source: h5py.File, target: h5py.File, path: Path, end: tuple[str, str], lost: list[str]) -> None:
    recovered = f"recovered from {path.name}, which was not closed in order"
    outcome, why = end
    cause = f"{why}; {recovered}" if why else recovered
    if "end" in target and text_of(target["end/outcome"][()]) == "running":
        target["end/outcome"][...] = fixed(outcome, OUTCOME_BYTES)
        target["end/cause"][...] = fixed(cause, CAUSE_BYTES)
        target.attrs["outcome"] = fixed(outcome, OUTCOME_BYTES)
    sentences = [cause, *lost]
    if "events" in source:
        events = table(source, "events")
        old = _old_events(events, sentences)
        new = np.zeros(len(sentences), dtype=old.dtype)
        new["time"] = _latest(target)
        new["level"] = b"warning"
        new["text"] = [text.encode() for text in sentences]
        made = target.create_dataset("events", data=np.concatenate([old, new]))
        if events is not None:
            _copy_attributes(events, made, [])


def _old_events(events: h5py.Dataset | None, sentences: list[str]) -> NDArray[Any]:
    if events is None:
        sentences.append("/events can't be read")
        return np.zeros(0, EVENT_TYPE)
    try:
        rows: NDArray[Any] = events[()]
    except DAMAGE as error:
        sentences.append(f"/events can't be read: {error}")
        return np.zeros(0, EVENT_TYPE)
    return rows


def _latest(file: h5py.File) -> float:
    times = [group["time"] for group in file["streams"].values() if "time" in group]
    return max((float(time[-1]) for time in times if len(time)), default=0.0)


def sentence(loss: Loss) -> str:
    """One stream's loss in words."""
    return (
        f"{loss.stream}: {loss.kept} rows kept; {loss.unfinished} unfinished rows left out; at most {loss.unflushed} "
        "more had come after the last flush and are lost"
    )
