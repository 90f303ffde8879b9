"""Where a result is written: an option of the command line that refuses what must not be overwritten."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import click

from rig.errors import ConfigError


class ResultPath(click.Path):
    """A file that may be overwritten, for a result can be computed again. A recording cannot, whatever its name."""

    def __init__(self, *, dir_okay: bool = True) -> None:
        super().__init__(dir_okay=dir_okay, path_type=Path)

    def convert(self, value: str | os.PathLike[str], param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """A Path. Raises ConfigError for a recording."""
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        if path.is_file() and _is_recording(path):
            name = param.opts[-1] if param is not None else ""
            raise ConfigError(
                f"{name} {path}: this is an HDF5 file, and a recording is never overwritten; choose another name"
            )
        return path


def require_different(*named: tuple[str, Path | None]) -> None:
    """Of (option, path). Raises ConfigError where two are one file, for the later would be written over the other."""
    seen: dict[Path, str] = {}
    for option, path in named:
        if path is None or str(path) == "-":
            continue
        other = seen.setdefault(path.resolve(), option)
        if other != option:
            raise ConfigError(f"{option} {path}: {other} names the same file; choose another name for {option}")


def _is_recording(path: Path) -> bool:
    from rig.hdf5 import is_hdf5  # only where there is a file of that name

    return is_hdf5(path)


RESULT = ResultPath()
"""Also `-`, standard output."""
RESULT_FILE = ResultPath(dir_okay=False)
