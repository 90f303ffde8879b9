"""Names, types and sizes that writer and reader share."""

from __future__ import annotations

from typing import Any, Final

import h5py
import numpy as np

FORMAT: Final = "thruster-rig-recording"
FORMAT_VERSION: Final = 1
LIBVER: Final = ("v110", "v110")
"""Oldest file version with SWMR; HDF5 1.10 and later read it."""
CHUNK_ROWS: Final = 1024
"""Rows per chunk: 8 KiB, so that a flush four times a second rewrites little of a slow stream."""
PAGE_BYTES: Final = 4096
"""No piece of the file's own structure that is shorter crosses such a boundary. A kill can stop the kernel within a
write, but only between two pages of memory: so it leaves the piece whole, old or new (measured by replaying writes)."""
OUTCOME_BYTES: Final = 16
CAUSE_BYTES: Final = 512
EVENT_BYTES: Final = 512
MISSING: Final = -(2**63)
"""Written where a device gave no count (int64 has no NaN); the attribute `missing_value` of the dataset says so."""
FLUSH_PERIOD: Final = 0.25
"""s between flushes; a crash loses at most this plus one flush."""


def text_type(size: int) -> np.dtype[Any]:
    """Fixed-length UTF-8 of `size` bytes: variable-length strings do not survive a kill."""
    kind: np.dtype[Any] = h5py.string_dtype("utf-8", size)
    return kind


STEP_TYPE: Final = np.dtype(
    [("index", "<i4"), ("phase", text_type(8)), ("command_voltage", "<f8"), ("t_start", "<f8"), ("t_end", "<f8")]
)
EVENT_TYPE: Final = np.dtype([("time", "<f8"), ("level", text_type(8)), ("text", text_type(EVENT_BYTES))])


def pieces(text: str, size: int) -> list[bytes]:
    r"""UTF-8 of `text` in pieces of at most `size` bytes, no character cut; at least one piece.

    >>> pieces("aüü", 4)
    [b'a\xc3\xbc', b'\xc3\xbc']
    """
    out, data = [], text.replace("\0", " ").encode("utf-8", "replace")
    while len(data) > size:
        cut = size
        while data[cut] & 0xC0 == 0x80:  # a continuation byte: RFC 3629 section 3
            cut -= 1
        out.append(data[:cut])
        data = data[cut:]
    return [*out, data]


def fixed(text: str, size: int | None = None) -> Any:
    """A scalar for an attribute or a dataset; without `size` as long as the text, with it cut to fit."""
    data = pieces(text, size)[0] if size is not None else text.encode("utf-8", "replace")
    return np.array(data, dtype=text_type(max(size or len(data), 1)))


def text_of(value: Any) -> str:
    """Any string HDF5 can hold, fixed or variable, scalar or one-element, as str."""
    if isinstance(value, np.ndarray):
        value = value.reshape(-1)[0] if value.size else ""
    return value.decode("utf-8", "replace").rstrip("\0") if isinstance(value, bytes) else str(value)
