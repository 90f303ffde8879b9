"""A folder of CSV files: one per stream, the unit beside each name, an empty cell where the device gave nothing.

One line of names keeps a column of numbers a column of numbers for Excel, MATLAB's readtable, pandas, polars and
duckdb; a second one with units would make texts of them all.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from identification.recording import Floats
from rig.exporting.content import EVENT_COLUMNS, STEP_COLUMNS, Column, Content
from rig.names import file_inside


def write(content: Content, out: Path) -> None:
    """`out`, a new folder: streams/<stream>.csv, steps.csv, events.csv and header.json, all UTF-8."""
    (out / "streams").mkdir(parents=True)
    for stream in content.streams:
        rows = chain.from_iterable(map(_rows, stream.rows.pieces()))
        _write(file_inside(out / "streams", stream.name, ".csv"), stream.columns, rows)
    _write(out / "steps.csv", STEP_COLUMNS, content.steps)
    _write(out / "events.csv", EVENT_COLUMNS, content.events)
    (out / "header.json").write_text(json.dumps(content.header, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def _rows(piece: tuple[Floats, ...]) -> Iterable[Sequence[Any]]:
    """The shortest text of each number that reads back as the same one is what `csv` writes of a Python float."""
    return zip(*map(_cells, piece), strict=True)


def _cells(values: Floats) -> list[Any]:
    cells: list[Any] = values.tolist()
    for gap in np.flatnonzero(np.isnan(values)).tolist():
        cells[gap] = None
    return cells


def _write(path: Path, columns: Iterable[Column], rows: Iterable[Sequence[Any]]) -> None:
    with path.open("x", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([column.title for column in columns])
        writer.writerows(rows)
