"""Opening a recording to read it: whether it is one, whole or as its writer left it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from rig.errors import RecordingError
from rig.hdf5.layout import FORMAT, FORMAT_VERSION, text_of
from rig.hdf5.members import DAMAGE, member
from rig.hdf5.unclosed import open_unclosed


def is_hdf5(path: Path) -> bool:
    """Whether a file is HDF5, whatever its name. Raises RecordingError for one that can't be read."""
    try:
        return path.is_file() and bool(h5py.is_hdf5(path))
    except OSError as error:
        raise RecordingError(f"{path} can't be read: {error}") from error


def require_file(path: Path) -> None:
    """Raises RecordingError for what is not there or is no regular file."""
    if not path.is_file():
        raise RecordingError(f"{path} is not there; give the path of a recording (*.h5)")


def open_for_reading(path: Path) -> tuple[h5py.File, str]:
    """The open file and `plain` or `swmr`; its format has been checked. Raises RecordingError."""
    require_file(path)
    if not is_hdf5(path):
        raise RecordingError(f"{path} is not an HDF5 file; `rig import` makes recordings of tables and logs")
    try:
        file, opened_as = h5py.File(path, "r"), "plain"
    except OSError as error:
        file, opened_as = open_unclosed(path, error), "swmr"
    try:
        _check_format(file, path)
    except RecordingError:
        file.close()
        raise
    except DAMAGE as error:
        file.close()
        raise RecordingError(f"{path} is damaged: {error}") from error
    return file, opened_as


def _check_format(file: h5py.File, path: Path) -> None:
    found = text_of(file.attrs.get("format", ""))
    if found != FORMAT:
        raise RecordingError(f"{path} is HDF5, but its attribute `format` is {found!r} where {FORMAT!r} is expected")
    version = number(file.attrs.get("format_version", 1))
    if version is None or version > FORMAT_VERSION:
        raise RecordingError(
            f"{path} is a recording of format_version {text_of(file.attrs['format_version'])}; this program reads "
            f"up to {FORMAT_VERSION}; install a later thruster-rig"
        )
    if not isinstance(member(file, "streams"), h5py.Group):
        raise RecordingError(f"{path} says it is a recording, but has no group /streams")


def number(value: Any) -> float | None:
    """A finite number of whatever HDF5 holds; None for anything else."""
    try:
        number = float(np.asarray(value).reshape(-1)[0]) if value is not None else np.nan
    except (TypeError, ValueError, IndexError):
        return None
    return number if np.isfinite(number) else None
