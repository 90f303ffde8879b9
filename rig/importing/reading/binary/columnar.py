"""Tables of columns: Parquet by pyarrow, TDMS by npTDMS, MDF by asammdf."""

from __future__ import annotations

import gc
import sys
from collections.abc import Sequence
from io import BytesIO
from typing import Any

import numpy as np

from rig.errors import RecordingError
from rig.importing.reading.binary.frames import Floats, Frame, numeric


def parquet(data: bytes, _wanted: Sequence[str]) -> list[Frame]:
    """One frame; times as s since 1970."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pq.read_table(pa.BufferReader(data))
    found = {name: numeric(table[name].to_numpy()) for name in table.column_names}
    return [Frame("", {name: values for name, values in found.items() if values is not None})]


def tdms(data: bytes, _wanted: Sequence[str]) -> list[Frame]:
    """A frame a group; where its channels have unequal rates, or lengths without a rate, a frame a channel,
    `group/channel`. Of a file that was cut off the rows that are whole."""
    from nptdms import TdmsFile

    frames = []
    for group in TdmsFile.read(BytesIO(data)).groups():
        found = {channel.name: channel for channel in group.channels() if numeric(channel[:]) is not None}
        lengths = {len(channel) for channel in found.values()}
        steps = {channel.properties.get("wf_increment") for channel in found.values()}
        if found and len(steps) == 1 and (len(lengths) == 1 or steps != {None}):
            rows = min(lengths)
            time = _track(next(iter(found.values())))
            columns = {name: _values(channel)[:rows] for name, channel in found.items()}
            frames.append(Frame(group.name, columns, None if time is None else time[:rows]))
        else:
            frames += [
                Frame(f"{group.name}/{name}", {name: _values(channel)}, _track(channel))
                for name, channel in found.items()
            ]
    return frames


def _values(channel: Any) -> Floats:
    found = numeric(channel[:])
    return np.zeros(0) if found is None else found


def _track(channel: Any) -> Floats | None:
    """Of a waveform: increment and offset in s are in its properties."""
    step = channel.properties.get("wf_increment")
    first = float(channel.properties.get("wf_start_offset", 0.0))
    return None if step is None else np.asarray(first + float(step) * np.arange(len(channel)), np.float64)


def _opened_mdf(data: bytes) -> Any:
    """Raises RecordingError. What its constructor did not finish its destructor complains of on the terminal, once the
    error is gone: here, where nobody hears it."""
    from asammdf import MDF

    failed, told = "", sys.unraisablehook
    try:
        return MDF(BytesIO(data))
    except Exception as error:  # noqa: BLE001 - whatever it raises for bytes that it does not understand
        failed = f"{type(error).__name__}: {error}"
    sys.unraisablehook = lambda _: None
    try:
        gc.collect()
    finally:
        sys.unraisablehook = told
    raise RecordingError(f"this measurement file MDF/MF4 can't be read, it may be cut off or damaged ({failed})")


def mdf(data: bytes, _wanted: Sequence[str]) -> list[Frame]:
    """A frame a channel group, by its name or `group<i>`, its time that of the group's master."""
    frames: list[Frame] = []
    with _opened_mdf(data) as file:
        groups: Sequence[Any] = file.groups
        for i, group in enumerate(groups):
            columns: dict[str, Floats] = {}
            time: Floats | None = None
            for j, channel in enumerate(group.channels):
                signal = file.get(group=i, index=j, ignore_invalidation_bits=True)
                values = numeric(signal.samples)
                if j == file.masters_db.get(i):
                    time = np.asarray(signal.timestamps, np.float64)
                elif values is not None:
                    columns[channel.name] = values
                    time = np.asarray(signal.timestamps, np.float64) if time is None else time
            name = str(getattr(group.channel_group, "acq_name", "") or f"group{i}")
            frames.append(Frame(name if all(name != f.name for f in frames) else f"group{i}", columns, time))
    return frames
