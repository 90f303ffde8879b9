"""TOML tables into frozen dataclasses, or a ConfigError that names file, key, what was expected and what came."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Any, Final, TypeVar, get_args, get_type_hints

from pydantic import TypeAdapter, ValidationError

from rig.errors import ConfigError, PlanError
from rig.regular_file import read

MOST_BYTES: Final = 2**20
"""Of a TOML file; the longest bench here has 5 kB, a designed campaign some 20."""
MOST_DEPTH: Final = 16
LONG_KEY: Final = re.compile(
    r"""(?:^|[\[{,])[ \t]*+(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')(?:[ \t]*+\.[ \t]*+(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+'))"""
    f"{{{MOST_DEPTH}}}",
    re.MULTILINE,
)
"""tomllib takes a time that grows as the square of the parts of a key."""
T = TypeVar("T")
Table = Mapping[str, Any]


def read_toml(path: Path, what: str) -> tuple[str, dict[str, Any]]:
    """Text and content of a TOML file; `what` names it in the error (`bench file`)."""
    try:
        text = read(path, what, MOST_BYTES, ConfigError).decode("utf-8")
    except FileNotFoundError:
        raise ConfigError(f"{path}: there is no such {what}; give the path of one") from None
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: this {what} can't be read: {error}") from None
    return text, parsed(text.replace("\r\n", "\n"), path)


def parsed(text: str, path: Path | str) -> dict[str, Any]:
    """TOML of a bounded depth whose numbers are those that TOML knows. Raises ConfigError."""
    if LONG_KEY.search(text):
        raise ConfigError(f"{path}: a key has more than {MOST_DEPTH} parts; nothing here is so deep: shorten it")
    try:
        content = tomllib.loads(text)
    except ValueError as error:  # beside what is no TOML: a number of more digits than Python reads
        raise ConfigError(f"{path}: not valid TOML: {error}") from None
    except RecursionError:
        raise ConfigError(f"{path}: arrays or tables are nested too deeply; {MOST_DEPTH} levels are allowed") from None
    _require_bounded(content, path, "")
    return content


def _require_bounded(value: Any, path: Path | str, key: str, depth: int = 0) -> None:
    if depth > MOST_DEPTH:
        raise ConfigError(f"{path}: {key[:60]} is nested more than {MOST_DEPTH} levels deep; nothing here needs that")
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise ConfigError(
            f"{path}: {key} is a number of {value.bit_length()} bits; TOML knows 64: is it a typing error?"
        )
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for name, item in items:
        _require_bounded(item, path, joined(key, name) if isinstance(name, str) else f"{key}[{name}]", depth + 1)


def joined(prefix: str, key: str) -> str:
    """Dotted path of a key; a key with a dot is quoted as TOML would."""
    shown = f'"{key}"' if "." in key else key
    return f"{prefix}.{shown}" if prefix else shown


def refuse_unknown(path: Path, prefix: str, keys: Iterable[str], known: Iterable[str]) -> None:
    """Raise for the first key that is not known, naming the nearest one that is."""
    known = sorted(known)
    for key in keys:
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
            hint = f"did you mean {joined(prefix, near[0])}?" if near else f"known are {', '.join(known)}"
            raise ConfigError(f"{path}: unknown key {joined(prefix, key)}; {hint}")


def table_at(path: Path, content: Table, key: str, prefix: str = "", optional: bool = False) -> dict[str, Any]:
    """The table at `key`; an absent optional one is empty."""
    if key not in content and optional:
        return {}
    if key not in content:
        raise ConfigError(f"{path}: missing table [{joined(prefix, key)}]")
    found = content[key]
    if not isinstance(found, dict):
        raise ConfigError(f"{path}: {joined(prefix, key)} must be a table, but is {found!r}")
    return found


def decode(cls: type[T], table: Table, path: Path, prefix: str) -> T:
    """An instance of the dataclass `cls` from a table. Types are strict; a whole number passes for a number."""
    return construct(cls, values(cls, table, path, prefix), path, prefix)


def values(
    cls: type[Any], table: Table, path: Path, prefix: str, *, elsewhere: Iterable[str] = (), also: Iterable[str] = ()
) -> dict[str, Any]:
    """Checked keyword arguments for `cls`, of the keys of `table`.

    Fields of `cls` named in `elsewhere` are no keys; keys in `also` are allowed and left to the caller.
    """
    wanted = {field.name: field for field in fields(cls) if field.init and field.name not in tuple(elsewhere)}
    refuse_unknown(path, prefix, table, (*wanted, *also))
    hints = get_type_hints(cls)
    for name, field in wanted.items():
        if name not in table and field.default is MISSING and field.default_factory is MISSING:
            raise ConfigError(f"{path}: missing key {joined(prefix, name)} ({_type_said(hints[name])})")
    return {key: typed(hints[key], value, path, joined(prefix, key)) for key, value in table.items() if key in wanted}


def construct(cls: type[T], arguments: Mapping[str, Any], path: Path, prefix: str) -> T:
    """`cls(**arguments)`; what its own checks refuse becomes an error of this file."""
    try:
        return cls(**arguments)
    except PlanError as error:
        raise PlanError(f"{path}: [{prefix}]: {error}") from None
    except ValueError as error:
        raise ConfigError(f"{path}: [{prefix}]: {error}") from None


def typed(hint: Any, value: Any, path: Path, key: str) -> Any:
    """`value` if it is of the type `hint`; arrays become tuples, text becomes a Path where one is asked for."""
    if is_dataclass(hint) and isinstance(hint, type) and isinstance(value, dict):
        return decode(hint, value, path, key)
    if hint is Path and isinstance(value, str):
        return Path(value)
    try:
        return TypeAdapter(hint).validate_python(_tuples(value), strict=True)
    except ValidationError as error:
        reason = error.errors()[0]
        where = "".join(f"[{part}]" for part in reason["loc"] if isinstance(part, int))
        raise ConfigError(f"{path}: {key}{where} must be {_type_said(hint)}, but is {value!r}") from None


def _tuples(value: Any) -> Any:
    return tuple(_tuples(item) for item in value) if isinstance(value, list) else value


WORDS = {
    "str": "text",
    "float": "a number",
    "int": "a whole number",
    "bool": "true or false",
    "date": "a date such as 2026-03-01",
    "datetime.date": "a date such as 2026-03-01",
}


def _type_said(hint: Any) -> str:
    """The type in an operator's words."""
    if type(None) in get_args(hint) and len(get_args(hint)) == 2:
        return _type_said(next(each for each in get_args(hint) if each is not type(None)))
    name = hint.__name__ if isinstance(hint, type) else str(hint)
    if hint is Path:
        return "a path"
    if name in WORDS and isinstance(hint, type):
        return WORDS[name]
    said = str(hint).replace("typing.", "").replace("Literal[", "one of [").replace(" | None", "").replace(", ...", "")
    for short, long in (("tuple[str]", "an array of text"), ("tuple[float]", "an array of numbers")):
        said = said.replace(short, long)
    return WORDS.get(said, said)
