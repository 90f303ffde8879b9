"""A folder of Parquet files: one per stream, unit and quantity in the metadata of each field, null for a gap."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from rig.exporting.content import EVENT_COLUMNS, STEP_COLUMNS, Column, Content
from rig.names import file_inside

HEADER = "thruster_rig"
"""Key of the header, as JSON, in the metadata of every file."""

TYPES = {"number": pa.float64(), "whole": pa.int32(), "text": pa.string()}


def write(content: Content, out: Path) -> None:
    """`out`, a new folder: streams/<stream>.parquet, steps.parquet, events.parquet."""
    (out / "streams").mkdir(parents=True)
    about = {HEADER: json.dumps(content.header, ensure_ascii=False)}
    for stream in content.streams:
        schema = _schema(stream.columns, about)
        with pq.ParquetWriter(file_inside(out / "streams", stream.name, ".parquet"), schema) as file:
            for piece in stream.rows.pieces():
                arrays = [pa.array(column, mask=np.isnan(column)) for column in piece]
                file.write_table(pa.Table.from_arrays(arrays, schema=schema))
    _write(out / "steps.parquet", _schema(STEP_COLUMNS, about), content.steps)
    _write(out / "events.parquet", _schema(EVENT_COLUMNS, about), content.events)


def _schema(columns: Sequence[Column], about: Mapping[str, str]) -> Any:
    return pa.schema([pa.field(c.name, TYPES[c.kind], metadata=_metadata(c)) for c in columns], metadata=about)


def _metadata(column: Column) -> dict[str, str]:
    facts = {"unit": column.unit, **column.facts} if column.unit else column.facts
    return {name: value if isinstance(value, str) else json.dumps(value) for name, value in facts.items()}


def _write(path: Path, schema: Any, rows: Iterable[Sequence[Any]]) -> None:
    records = [dict(zip(schema.names, row, strict=True)) for row in rows]
    pq.write_table(pa.Table.from_pylist(records, schema=schema), path)
