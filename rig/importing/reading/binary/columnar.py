"""Tables of columns: Parquet by pyarrow, TDMS by npTDMS, MDF by asammdf."""

from __future__ import annotations

import gc
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from rig.errors import RecordingError
from rig.importing.reading.binary.frames import Columns, Floats, Frame, numeric

NUMBERS: Final = "biufmM"
"""Kinds of numpy that are numbers or times."""


def parquet(path: Path, _wanted: Sequence[str]) -> list[Frame]:
    """One frame; times as s since 1970."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    kinds = (pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean, pa.types.is_temporal)
    schema = pq.read_schema(path)
    names = [field.name for field in schema if any(kind(field.type) for kind in kinds)]

    def column(name: str) -> Floats:
        with pq.ParquetFile(path) as file:
            return _as_numbers(name, file.read(columns=[name])[name].to_numpy())

    return [Frame("", Columns(names, column))]


def _as_numbers(name: str, values: Any) -> Floats:
    found = numeric(values)
    if found is None:
        raise RecordingError(f"{name} is no column of numbers")
    return found


def tdms(path: Path, _wanted: Sequence[str]) -> list[Frame]:
    """A frame a group; where its channels have unequal rates, or lengths without a rate, a frame a channel,
    `group/channel`. Of a file that was cut off the rows that are whole."""
    from nptdms import TdmsFile

    frames = []
    with TdmsFile.open(path) as file:
        for group in file.groups():
            found = {channel.name: channel for channel in group.channels() if channel.dtype.kind in NUMBERS}
            lengths = {len(channel) for channel in found.values()}
            steps = {channel.properties.get("wf_increment") for channel in found.values()}
            if found and len(steps) == 1 and (len(lengths) == 1 or steps != {None}):
                rows = min(lengths)
                time = _track(next(iter(found.values())))
                columns = Columns(found, partial(_tdms_column, path, group.name, rows))
                frames.append(Frame(group.name, columns, None if time is None else time[:rows]))
            else:
                frames += [
                    Frame(
                        f"{group.name}/{name}",
                        Columns([name], partial(_tdms_column, path, group.name, len(channel))),
                        _track(channel),
                    )
                    for name, channel in found.items()
                ]
    return frames


def _tdms_column(path: Path, group: str, rows: int, name: str) -> Floats:
    from nptdms import TdmsFile

    with TdmsFile.open(path) as file:
        return _as_numbers(name, file[group][name][:rows])


def _track(channel: Any) -> Floats | None:
    """Of a waveform: increment and offset in s are in its properties."""
    step = channel.properties.get("wf_increment")
    first = float(channel.properties.get("wf_start_offset", 0.0))
    return None if step is None else np.asarray(first + float(step) * np.arange(len(channel)), np.float64)


def _opened_mdf(path: Path) -> Any:
    """Raises RecordingError. What its constructor did not finish its destructor complains of on the terminal, once the
    error is gone: here, where nobody hears it."""
    from asammdf import MDF

    failed, told = "", sys.unraisablehook
    try:
        return MDF(path)
    except Exception as error:  # noqa: BLE001 - whatever it raises for bytes that it does not understand
        failed = f"{type(error).__name__}: {error}"
    sys.unraisablehook = lambda _: None
    try:
        gc.collect()
    finally:
        sys.unraisablehook = told
    raise RecordingError(f"this measurement file MDF/MF4 can't be read, it may be cut off or damaged ({failed})")


def mdf(path: Path, wanted: Sequence[str]) -> list[Frame]:
    """A frame a channel group, by its name or `group<i>`, its time that of the group's master."""
    frames: list[Frame] = []
    with _opened_mdf(path) as file:
        groups: Sequence[Any] = file.groups
        for i, group in enumerate(groups):
            name = str(getattr(group.channel_group, "acq_name", "") or f"group{i}")
            name = name if all(name != frame.name for frame in frames) else f"group{i}"
            asked = not wanted or name in wanted
            frames.append(_mdf_group(path, file, i, name) if asked else Frame(name, {}))
    return frames


def _mdf_group(path: Path, file: Any, i: int, name: str) -> Frame:
    master = file.masters_db.get(i)
    places = {channel.name: j for j, channel in enumerate(file.groups[i].channels) if j != master}
    numbers = {name: j for name, j in places.items() if _is_number(file, i, j)}
    time = np.asarray(file.get_master(i), np.float64) if master is not None or numbers else None
    return Frame(name, Columns(numbers, partial(_mdf_column, path, i, numbers)), time)


def _is_number(file: Any, group: int, index: int) -> bool:
    """By its first row, as the file's conversions make it."""
    first = file.get(group=group, index=index, record_offset=0, record_count=1, ignore_invalidation_bits=True)
    return numeric(first.samples) is not None


def _mdf_column(path: Path, group: int, places: Mapping[str, int], name: str) -> Floats:
    with _opened_mdf(path) as file:
        return _as_numbers(name, file.get(group=group, index=places[name], ignore_invalidation_bits=True).samples)
