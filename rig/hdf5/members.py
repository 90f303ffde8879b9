"""What stands in a group of a file that may be damaged or come from a stranger: only what can be opened, and only what
lies in the file itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import h5py

DAMAGE: Final = (OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError)
"""What h5py raises for a piece of a file that is torn or makes no sense."""
MOST_DEFLATED: Final = 1100
"""Times; zlib packs at most 1032 to 1 (zlib Technical Details)."""


def members(group: h5py.Group) -> Iterator[tuple[str, Any]]:
    """(name, object) of a group. What can't be opened, or stands in another file, is left out."""
    for name in list(group):
        try:
            if isinstance(group.get(name, getlink=True), h5py.ExternalLink):
                continue
            item = group[name]
        except DAMAGE:
            continue
        yield name, item


def numeric_columns(group: h5py.Group) -> dict[str, h5py.Dataset]:
    """Datasets of a stream that are one-dimensional and numeric, `time` among them."""
    return {name: item for name, item in members(group) if isinstance(item, h5py.Dataset) and _is_column(item)}


def _is_column(item: h5py.Dataset) -> bool:
    """Also: its values are in this file, which is long enough to hold them."""
    try:
        if item.ndim != 1 or item.dtype.kind not in "iufb" or item.external:
            return False
        stored = int(item.id.get_storage_size())
        return bool(item.size * item.dtype.itemsize <= stored * (MOST_DEFLATED if item.chunks else 1))
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
