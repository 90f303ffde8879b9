"""A recording whose writer was killed, or is at work, opened without HDF5's SWMR mode.

In that mode HDF5 reads a piece whose checksum is wrong up to a hundred times and doubles its pause each time (H5C.c,
H5C__load_entry): for a damaged file that is for ever. Here the superblock is read as h5clear(1) would write it, with no
mark of a writer and the end of the file where it is, so that the file opens plainly and damage is an error at once. The
file itself is not changed.
"""

from __future__ import annotations

import io
import os
import struct
import weakref
from pathlib import Path

import h5py

from rig.errors import RecordingError

SUPERBLOCK = struct.Struct("<8sBBBBQQQQI")
"""Versions 2 and 3, with addresses of 8 bytes: HDF5 File Format Specification 3.0, section II.A."""
SIGNATURE = b"\x89HDF\r\n\x1a\n"
GROWTH = 64 * 2**20
"""Bytes behind the end that read as zeros: a writer at work may point there already."""
WORD = 0xFFFFFFFF


class Mended:
    """The bytes of a file with another superblock, for h5py's driver `fileobj`, which only reads."""

    def __init__(self, path: Path) -> None:
        self._fd = os.open(path, os.O_RDONLY)
        weakref.finalize(self, os.close, self._fd)
        self._at = 0
        self._end = os.fstat(self._fd).st_size + GROWTH
        self._start = _superblock(path, os.pread(self._fd, SUPERBLOCK.size, 0), self._end)

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        self._at = offset + {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self._end}[whence]
        return self._at

    def tell(self) -> int:
        return self._at

    def read(self, size: int) -> bytes:
        data = os.pread(self._fd, size, self._at).ljust(size, b"\0")
        if self._at < len(self._start):
            data = (self._start[self._at :] + data[len(self._start) - self._at :])[:size]
        self._at += size
        return data

    def flush(self) -> None:
        """Nothing is ever written."""


def open_unclosed(path: Path, reason: OSError) -> h5py.File:
    """Raises RecordingError for a file that is damaged, with `reason`, why it does not open as it is."""
    try:
        return h5py.File(Mended(path), "r")
    except (OSError, RuntimeError, ValueError) as error:
        raise RecordingError(
            f"{path} can't be opened, neither as it is nor as one that was not closed: {reason}; {error}"
        ) from None


def _superblock(path: Path, found: bytes, end: int) -> bytes:
    if len(found) < SUPERBLOCK.size or not found.startswith(SIGNATURE) or found[8] not in (2, 3) or found[9] != 8:
        raise RecordingError(f"{path} can't be opened: it is HDF5, but was cut off, or its beginning is damaged")
    signature, version, offsets, lengths, _flags, base, extension, _end, root, _sum = SUPERBLOCK.unpack(found)
    mended = SUPERBLOCK.pack(signature, version, offsets, lengths, 0, base, extension, end, root, 0)
    return mended[:-4] + struct.pack("<I", lookup3(mended[:-4]))


def lookup3(data: bytes) -> int:
    """HDF5's checksum: hashlittle() of Bob Jenkins' lookup3.c with an initial value of 0.

    >>> hex(lookup3(b"Four score and seven years ago"))
    '0x17770551'
    """
    a = b = c = (0xDEADBEEF + len(data)) & WORD
    whole = max(len(data) - 1, 0) // 12 * 12
    for i in range(0, whole, 12):
        x, y, z = struct.unpack_from("<3I", data, i)
        a, b, c = _mix((a + x) & WORD, (b + y) & WORD, (c + z) & WORD)
    if not data:
        return c
    x, y, z = struct.unpack("<3I", data[whole:].ljust(12, b"\0"))
    return _final((a + x) & WORD, (b + y) & WORD, (c + z) & WORD)


def _rotated(x: int, k: int) -> int:
    return ((x << k) | (x >> (32 - k))) & WORD


def _mix(a: int, b: int, c: int) -> tuple[int, int, int]:
    for i, j, k in ((4, 6, 8), (16, 19, 4)):
        a, c = ((a - c) & WORD) ^ _rotated(c, i), (c + b) & WORD
        b, a = ((b - a) & WORD) ^ _rotated(a, j), (a + c) & WORD
        c, b = ((c - b) & WORD) ^ _rotated(b, k), (b + a) & WORD
    return a, b, c


def _final(a: int, b: int, c: int) -> int:
    for i, j, k in ((14, 11, 25), (16, 4, 14)):
        c = ((c ^ b) - _rotated(b, i)) & WORD
        a = ((a ^ c) - _rotated(c, j)) & WORD
        b = ((b ^ a) - _rotated(a, k)) & WORD
    return ((c ^ b) - _rotated(b, 24)) & WORD
