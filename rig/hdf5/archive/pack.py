"""A packed copy of a closed recording: long columns in large compressed chunks with a checksum each, everything else
as it is, compared with the raw file bit for bit before it gets its name.

The recorder's own layout (chunks of 1,024 rows, so that a flush rewrites little) costs a reader over a network many
small requests; here a column of a long run is a few.
"""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import file_digest
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np

from rig.errors import RecordingError
from rig.hdf5.apart import apart, open_no_more
from rig.hdf5.layout import LIBVER, fixed
from rig.hdf5.members import DAMAGE, attributes, is_column, members
from rig.hdf5.opening import open_for_reading

CHUNK_ROWS: Final = 131_072
"""1 MiB of numbers."""
LONG: Final = 256
"""Rows, from which a column is packed."""
LEVEL: Final = 4
"""Of gzip: beyond it files hardly become smaller."""
SMALL, PAGES = 4 * 2**20, (4_096, 65_536)
"""Bytes of a file; and of the pages in which its own structure lies together, to be read at once: of a small file, and
of any other."""
PACKED_FROM: Final = "packed_from"
PACKED_SHA256: Final = "packed_sha256"


@dataclass(frozen=True, slots=True)
class Packed:
    """What became of a file: bytes before and after."""

    path: Path
    before: int
    after: int


def pack(path: Path, out: Path) -> Packed:
    """Write `out`, a new file. Raises RecordingError where `path` was not closed in order or is damaged, OSError.

    The copy has two root attributes more: `packed_from`, the name of the raw file, and `packed_sha256`, of its bytes.
    """
    if out.exists():
        raise RecordingError(f"{out} exists; a recording is never overwritten: give another folder with --to")
    with path.open("rb") as file:
        digest = file_digest(file, "sha256").hexdigest()
    part = out.with_name(f".{out.name}.part")
    try:
        apart(lambda: _packed(path, part, digest), path)
        apart(lambda: _require_same(path, part), path)
        part.rename(out)
    finally:
        part.unlink(missing_ok=True)
    return Packed(out, path.stat().st_size, out.stat().st_size)


def _packed(path: Path, part: Path, digest: str) -> None:
    source, opened_as = open_for_reading(path)
    with source:
        if opened_as != "plain":
            raise RecordingError(f"{path} was not closed in order; save it first: rig recover {path}")
        try:
            pages = PAGES[path.stat().st_size > SMALL]
            made = {"libver": LIBVER, "fs_strategy": "page", "fs_page_size": pages}
            with h5py.File(part, "w", track_order=True, **made) as target:
                open_no_more()
                _copy(source, target)
                target.attrs[PACKED_FROM] = fixed(path.name)
                target.attrs[PACKED_SHA256] = fixed(digest)
        except DAMAGE as error:
            raise RecordingError(f"{path} is damaged ({error}) and was not packed; see rig recover") from error


def _copy(source: h5py.Group, target: h5py.Group) -> None:
    _copy_attributes(source, target)
    for name, item in members(source):
        if isinstance(item, h5py.Group):
            _copy(item, target.create_group(name, track_order=True))
        elif is_column(item) and len(item) >= LONG:
            rows = min(len(item), CHUNK_ROWS)
            how = {"chunks": (rows,), "compression": "gzip", "compression_opts": LEVEL, "shuffle": True}
            column = target.create_dataset(name, (len(item),), item.dtype, fletcher32=True, **how)
            for first in range(0, len(item), rows):
                column[first : first + rows] = item[first : first + rows]
            _copy_attributes(item, column)
        else:
            source.copy(item, target, name=name)


def _copy_attributes(source: Any, target: Any) -> None:
    unreadable: list[str] = []
    for name, value in attributes(source, unreadable).items():
        target.attrs.create(name, value, dtype=source.attrs.get_id(name).dtype)
    if unreadable:
        raise ValueError(unreadable[0])


def _require_same(path: Path, part: Path) -> None:
    """Raises RecordingError where the copy does not hold what the raw file does."""
    with h5py.File(path, "r") as raw, h5py.File(part, "r") as copy:
        open_no_more()
        try:
            differs = _difference(raw, copy)
        except DAMAGE as error:
            raise RecordingError(
                f"{path}: its packed copy can't be read back ({error}); nothing was written"
            ) from error
    if differs:
        raise RecordingError(f"{path}: its packed copy differs at {differs}; nothing was written")


def _difference(raw: h5py.Group, copy: h5py.Group) -> str:
    """Name of the first object of which the copy does not hold the same; empty where there is none."""
    known = dict(members(copy))
    if not _same_attributes(raw, copy):
        return str(raw.name)
    for name, item in members(raw):
        other = known.get(name)
        if isinstance(item, h5py.Group):
            found = _difference(item, other) if isinstance(other, h5py.Group) else str(item.name)
            if found:
                return found
        elif not isinstance(other, h5py.Dataset) or not (_same_attributes(item, other) and _same_values(item, other)):
            return str(item.name)
    return ""


def _same_attributes(raw: Any, copy: Any) -> bool:
    return all(
        name in copy.attrs and np.asarray(copy.attrs[name]).tobytes() == np.asarray(value).tobytes()
        for name, value in raw.attrs.items()
        if np.asarray(value).dtype.kind != "O"
    )


def _same_values(raw: h5py.Dataset, copy: h5py.Dataset) -> bool:
    if raw.shape != copy.shape or raw.dtype != copy.dtype:
        return False
    if raw.ndim != 1:
        return bool(np.asarray(raw[()]).tobytes() == np.asarray(copy[()]).tobytes())
    return all(
        raw[first : first + CHUNK_ROWS].tobytes() == copy[first : first + CHUNK_ROWS].tobytes()
        for first in range(0, max(len(raw), 1), CHUNK_ROWS)
    )
