"""TOML tables into dataclasses; an unknown key is an error that names the nearest known one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from difflib import get_close_matches
from typing import Any, TypeVar

T = TypeVar("T")


class WorldError(Exception):
    """A world file that cannot be run: names the table, what was expected and what came."""


def check_known(key: str, known: Iterable[str], where: str) -> None:
    """Raise WorldError naming the nearest known key when `key` is not one of `known`."""
    names = sorted(known)
    if key in names:
        return
    near = get_close_matches(key, names, n=1, cutoff=0.4)
    hint = f"did you mean {near[0]!r}?" if near else f"known are: {', '.join(names)}"
    raise WorldError(f"{where}: unknown name {key!r}; {hint}")


def build(cls: type[T], table: Any, where: str) -> T:
    """Make a dataclass of a TOML table. Fields hold float, int, bool, str or a tuple of str.

    Raises WorldError for an unknown key, a missing one, or a value of the wrong type.
    """
    if not isinstance(table, Mapping):
        raise WorldError(f"{where}: expected a table of settings, got {table!r}")
    known = {f.name: f for f in fields(cls) if f.init}  # type: ignore[arg-type]  # T is always a dataclass here
    values: dict[str, Any] = {}
    for key, value in table.items():
        check_known(key, known, where)
        values[key] = _converted(value, str(known[key].type), f"{where}.{key}")
    for name, f in known.items():
        if name not in values and f.default is MISSING and f.default_factory is MISSING:
            raise WorldError(f"{where}: {name!r} is missing; give it a value ({f.type})")
    try:
        return cls(**values)
    except ValueError as error:
        raise WorldError(f"{where}: {error}") from error


def _converted(value: Any, kind: str, where: str) -> Any:
    if kind == "float" and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if kind == "bool" and isinstance(value, bool):
        return value
    if kind == "int" and isinstance(value, int) and not isinstance(value, bool):
        return value
    if kind.startswith("str") and isinstance(value, str):
        return value
    if kind.startswith("tuple") and isinstance(value, list) and all(isinstance(v, str) for v in value):
        return tuple(value)
    raise WorldError(f"{where}: expected {kind}, got {value!r}")
