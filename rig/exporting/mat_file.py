"""A MATLAB file: a struct per stream with a field per channel, the same names again with their units.

`load T1.mat; plot(streams.load_cell.time, streams.load_cell.thrust); ylabel(units.load_cell.thrust)`
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.io import savemat

from identification.recording import Floats
from rig.errors import RecordingError
from rig.exporting.content import EVENT_COLUMNS, STEP_COLUMNS, Column, Content, Stream

LONGEST_NAME = 63
"""Letters of a name: namelengthmax of MATLAB."""
MOST_BYTES = 2**31
"""Of one variable in a MAT file of version 5 to 7 (MathWorks, MAT-File Versions)."""


def write(content: Content, out: Path) -> None:
    """`out`, a new file with streams, units, steps, events and header. Raises RecordingError for what is too large.

    The rows wait on disk beside `out`, so that memory holds one column at most.
    """
    names = identifiers(stream.name for stream in content.streams)
    with TemporaryDirectory(dir=out.parent, prefix=f".{out.name}") as waiting:
        gathered = [
            _gathered(stream, Path(waiting) / name) for name, stream in zip(names, content.streams, strict=True)
        ]
        if (size := sum(column.nbytes for columns in gathered for column in columns.values())) >= MOST_BYTES:
            raise RecordingError(
                f"--to mat: the streams take {size / 2**30:.1f} GiB, but a MAT file holds 2: fewer --streams, or mcap"
            )
        savemat(
            out,
            {
                "streams": dict(zip(names, gathered, strict=True)),
                "units": dict(zip(names, map(_units, content.streams), strict=True)),
                "steps": _table(STEP_COLUMNS, content.steps),
                "events": _table(EVENT_COLUMNS, content.events),
                "header": _plain(content.header),
            },
            long_field_names=True,
            oned_as="column",
            appendmat=False,
        )


def identifiers(names: Iterable[str]) -> list[str]:
    """Names as MATLAB takes them, each once.

    >>> identifiers(["load cell", "load_cell", "2nd"])
    ['load_cell', 'load_cell_2', 'x2nd']
    """
    found: list[str] = []
    for name in names:
        plain = re.sub(r"[^0-9A-Za-z_]", "_", name)
        first = (plain if re.match(r"[A-Za-z]", plain) else f"x{plain}")[: LONGEST_NAME - 4]
        found.append(next(each for each in _numbered(first) if each not in found))
    return found


def _numbered(name: str) -> Iterator[str]:
    yield name
    for number in range(2, 10**6):
        yield f"{name}_{number}"


def _gathered(stream: Stream, folder: Path) -> dict[str, Floats]:
    """The columns of a stream, on disk in a new folder."""
    folder.mkdir()
    names = _names(stream)
    with ExitStack() as stack:
        files = [stack.enter_context((folder / name).open("wb")) for name in names]
        for piece in stream.rows.pieces():
            for file, column in zip(files, piece, strict=True):
                column.tofile(file)
    return {name: _mapped(folder / name) for name in names}


def _mapped(path: Path) -> Floats:
    return np.memmap(path, np.float64, "r") if path.stat().st_size else np.empty(0)


def _names(stream: Stream) -> list[str]:
    return identifiers(column.name for column in stream.columns)


def _units(stream: Stream) -> dict[str, str]:
    return dict(zip(_names(stream), (column.unit for column in stream.columns), strict=True))


def _table(columns: Sequence[Column], rows: Sequence[Sequence[Any]]) -> dict[str, Any]:
    """A struct of columns: numbers (n, 1), texts as a cell array (n, 1)."""
    values = {column.name: [row[k] for row in rows] for k, column in enumerate(columns)}
    texts = {column.name for column in columns if column.kind == "text"}
    return {name: _cell(found) if name in texts else np.array(found, np.float64) for name, found in values.items()}


def _cell(values: Sequence[Any]) -> Any:
    cell = np.empty(len(values), dtype=object)
    cell[:] = values
    return cell


def _plain(value: Any) -> Any:
    """What JSON can hold as MATLAB has it: struct, cell array, char, logical, double."""
    if isinstance(value, Mapping):
        return dict(zip(identifiers(value), map(_plain, value.values()), strict=True))
    if isinstance(value, list | tuple):
        return _cell([_plain(item) for item in value])
    if value is None:
        return np.empty(0)
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value
