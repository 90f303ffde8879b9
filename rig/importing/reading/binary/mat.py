"""MATLAB files: version 5 to 7.2 by scipy, 7.3 (HDF5 inside) by rig.hdf5."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rig.importing.reading.binary.frames import Frame, numeric

LATEST = b"\x89HDF\r\n\x1a\n"
HEAD = 512
"""Bytes that MATLAB puts before the HDF5 of a file of version 7.3."""


def mat(path: Path, wanted: Sequence[str]) -> list[Frame]:
    """A frame a struct, `a.b`, of its vectors of one length; those of the file itself are the frame ``."""
    with path.open("rb") as opened:
        head = opened.read(HEAD + len(LATEST))
        if head.startswith(LATEST) or head[HEAD:] == LATEST:
            from rig.hdf5.matlab import content_of_mat

            content = content_of_mat(path)
        else:
            from scipy.io import loadmat

            opened.seek(0)
            file: Any = opened  # a path, for its stubs
            content = loadmat(file, simplify_cells=True)
    frames = list(_frames(content, ""))
    return frames if wanted else frames[:1]


def _frames(content: Mapping[str, Any], place: str) -> Iterator[Frame]:
    """Of the vectors of a struct, then of the structs in it."""
    vectors = {name: found for name, value in content.items() for name, found in _vectors(name, value)}
    longest = max((values.size for values in vectors.values()), default=0)
    columns = {name: values for name, values in vectors.items() if values.size == longest and longest > 1}
    if columns:
        yield Frame(place, columns)
    for name, value in content.items():
        if isinstance(value, Mapping):
            yield from _frames(value, f"{place}.{name}" if place else name)


def _vectors(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """A vector, or the columns of a matrix by their number from 1, as MATLAB counts."""
    if name.startswith("__") or isinstance(value, Mapping | str | bytes):
        return
    array = np.asarray(value)
    if array.ndim == 2 and 1 in array.shape:
        array = array.reshape(-1)
    if array.ndim == 1 and (found := numeric(array)) is not None:
        yield name, found
    elif array.ndim == 2:
        for k in range(array.shape[1]):
            if (found := numeric(array[:, k])) is not None:
                yield f"{name}({k + 1})", found
