"""An answer for a reader: recordings by the names of their files, where programs are given their ids."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

T = TypeVar("T")
NO_NAMES: Mapping[str, str] = MappingProxyType({})


def file_names(paths: Iterable[Path]) -> dict[str, str]:
    """Recording id -> name of its file; with its folder where two files have one name. Raises RecordingError."""
    from rig.hdf5 import recording_id_of

    found = {recording_id_of(path): path for path in paths}
    names = [path.name for path in found.values()]
    return {
        name: path.name if names.count(path.name) == 1 else str(Path(path.parent.name) / path.name)
        for name, path in found.items()
        if name
    }


def with_names(text: str, names: Mapping[str, str]) -> str:
    """The text with every id replaced.

    >>> with_names("tare[6f1c] is 0.3 N", {"6f1c": "T1.h5"})
    'tare[T1.h5] is 0.3 N'
    """
    for identity, name in names.items():
        text = text.replace(identity, name)
    return text


def told_by_name(answer: T, names: Mapping[str, str]) -> T:
    """`answer`, a frozen dataclass, with every id in its texts and keys replaced; arrays and numbers are left."""
    found: T = _told(answer, names)
    return found


def _told(value: Any, names: Mapping[str, str]) -> Any:
    if isinstance(value, str):
        return with_names(value, names)
    if isinstance(value, tuple) and type(value) is tuple:
        parts = tuple(_told(part, names) for part in value)
        return parts if any(a is not b for a, b in zip(parts, value, strict=True)) else value
    if isinstance(value, Mapping):
        return {_told(key, names): _told(part, names) for key, part in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        new = {f.name: _told(getattr(value, f.name), names) for f in fields(value) if f.init}
        changed = {name: part for name, part in new.items() if part is not getattr(value, name)}
        return replace(value, **changed) if changed else value
    return value
