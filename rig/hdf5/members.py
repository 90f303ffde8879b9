"""What stands in a group of a file that may be damaged or come from a stranger: only what can be opened, and only what
lies in the file itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final

import h5py
import numpy as np
from h5py import h5d, h5i
from numpy.typing import NDArray

DAMAGE: Final = (OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError, OverflowError)
"""What h5py raises for a piece of a file that is torn or makes no sense."""
MOST_DEFLATED: Final = 1100
"""Times; zlib packs at most 1032 to 1 (zlib Technical Details)."""
MOST_SPARSE: Final = 64
"""Times; a column is made longer before its rows are written, and a disk that is full keeps them out."""
LARGEST_VALUE: Final = 1e30
"""In any SI unit; who squares and adds up what is larger gets no numbers."""
LARGEST_CHUNK: Final = 2**26
"""Bytes that a file may make HDF5 take at once, whatever its own size."""


def members(group: h5py.Group) -> Iterator[tuple[str, Any]]:
    """(name, object) of a group. What can't be opened, or only points to another place or file, is left out."""
    for name in list(group):
        item = member(group, name)
        if item is not None:
            yield name, item


def member(group: h5py.Group, name: str) -> Any:
    """One object of a group; None where there is none, it can't be opened, or it only points somewhere."""
    try:
        return group[name] if isinstance(group.get(name, getlink=True), h5py.HardLink) else None
    except DAMAGE:
        return None


def table(group: h5py.Group, name: str) -> h5py.Dataset | None:
    """A dataset of any type and shape whose values are in this file; None where there is no such."""
    item = member(group, name)
    return item if isinstance(item, h5py.Dataset) and _is_justified(item) else None


def numeric_columns(group: h5py.Group) -> dict[str, h5py.Dataset]:
    """Datasets of a stream that are one-dimensional and numeric, `time` among them."""
    return {name: item for name, item in members(group) if isinstance(item, h5py.Dataset) and is_column(item)}


def measured(raw: NDArray[Any], missing: Any) -> tuple[NDArray[np.float64], int]:
    """The values of a column, NaN where nothing was measured; and how many were larger than anything is."""
    value = raw.astype(np.float64)
    if missing is not None:
        value[raw == missing] = np.nan
    damaged = np.isfinite(value) & (np.abs(value) > LARGEST_VALUE)
    value[damaged | np.isinf(value)] = np.nan
    return value, int(damaged.sum())


def is_column(item: h5py.Dataset) -> bool:
    """Whether a dataset is one-dimensional and numeric, and its values are in its file."""
    try:
        return item.ndim == 1 and item.dtype.kind in "iufb" and _is_justified(item)
    except DAMAGE:
        return False


def _is_justified(item: h5py.Dataset) -> bool:
    """Whether its values are in this file, which is long enough to hold them."""
    try:
        made, size = item.id.get_create_plist(), h5i.get_file_id(item.id).get_filesize()
        layout = made.get_layout()
        if made.get_external_count() or layout == h5d.VIRTUAL:
            return False
        stored = min(int(item.id.get_storage_size()), size)
        chunk = math.prod(made.get_chunk()) * item.dtype.itemsize if layout == h5d.CHUNKED else 0
        most = MOST_DEFLATED if made.get_nfilters() > 0 else MOST_SPARSE
        return bool(item.size * item.dtype.itemsize <= stored * most + chunk and chunk <= max(LARGEST_CHUNK, size))
    except DAMAGE:
        return False


def attributes(item: h5py.Group | h5py.Dataset, unreadable: list[str]) -> dict[str, Any]:
    """All attributes that can be read; the names of the others are added to `unreadable`."""
    found = {}
    for name in list(item.attrs):
        try:
            found[name] = item.attrs[name]
        except DAMAGE as error:
            unreadable.append(f"the attribute {name} of {item.name} can't be read ({error})")
    return found
