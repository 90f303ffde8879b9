"""The text of a TOML file in which single values are changed; comments, order and formatting stay. Pure."""

from __future__ import annotations

import copy
import csv
import json
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from functools import lru_cache
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import Array, Item

from rig.errors import ConfigError
from rig.toml_tables import parsed

Key = tuple[str, ...]
"""Of a value: `("plan", "dwell", "settle")`."""


@dataclass(frozen=True, slots=True)
class Document:
    """A file's text; every change makes another one. `text` must be TOML, see `require_toml`."""

    text: str

    def value(self, key: Key) -> Any:
        """A plain Python value; None where there is none."""
        return _at(_plain(self.text), key)

    def written(self, key: Key) -> str:
        """The value as it stands in the file, without its comment; empty where there is none. Texts without quotes,
        arrays on one line without brackets, a text with a comma in an array quoted as CSV does."""
        found = _at(_styled(self.text), key)
        if found is None:
            return ""
        return _row([_shown(item) for item in found]) if isinstance(found, Array) else _shown(found)

    def with_value(self, key: Key, toml: str) -> Document:
        """With the TOML of another value at `key`; where there was none it is added at the end of its table.

        Raises ConfigError where the text is such that this would change anything else.
        """
        wanted = copy.deepcopy(_plain(self.text))
        _table(wanted, key[:-1], dict)[key[-1]] = tomllib.loads(f"value = {toml}")["value"]
        document = tomlkit.parse(self.text)
        new = tomlkit.parse(f"value = {toml}\n")["value"]
        table = _table(document, key[:-1], tomlkit.table)
        old = table.get(key[-1])
        if isinstance(old, Array) and isinstance(new, Array) and "\n" in old.as_string():
            _change_items(old, list(new))
        else:
            table[key[-1]] = new
        return _made(document, wanted, key)

    def without(self, key: Key) -> Document:
        """Without the value at `key` and the comment on its line. Raises ConfigError as `with_value`."""
        if self.value(key) is None:
            return self
        wanted = copy.deepcopy(_plain(self.text))
        del _table(wanted, key[:-1], dict)[key[-1]]
        document = tomlkit.parse(self.text)
        del _table(document, key[:-1], tomlkit.table)[key[-1]]
        return _made(document, wanted, key)


def items_of(text: str) -> list[str]:
    """What `Document.written` has put on one line.

    >>> items_of('T1, "T2 (left, new)",')
    ['T1', 'T2 (left, new)']
    """
    rows = list(csv.reader([text.replace("\n", " ")], skipinitialspace=True))
    return [item for part in (rows[0] if rows else []) if (item := part.strip())]


def _row(items: Sequence[str]) -> str:
    quoted = ['"' + item.replace('"', '""') + '"' if "," in item or '"' in item else item for item in items]
    return ", ".join(quoted)


@lru_cache(16)
def _plain(text: str) -> dict[str, Any]:
    """Read only."""
    return tomllib.loads(text.replace("\r\n", "\n"))


@lru_cache(16)
def _styled(text: str) -> Any:
    """Read only."""
    return tomlkit.parse(text)


def _made(document: Any, wanted: Mapping[str, Any], key: Key) -> Document:
    text = tomlkit.dumps(document)
    try:
        same = _sorted(_plain(text)) == _sorted(wanted)
    except tomllib.TOMLDecodeError:
        same = False
    if not same:
        raise ConfigError(f"{'.'.join(key)} stands where it can't be changed alone; change it in a text editor")
    return Document(text)


def _sorted(value: Any) -> Any:
    """For a comparison in which keys have no order, and a nan is itself."""
    return sorted((k, repr(_sorted(v))) for k, v in value.items()) if isinstance(value, Mapping) else repr(value)


def require_toml(path: object, text: str) -> None:
    """Raises ConfigError for a text that is no TOML, as the loader does, or that can't be edited without a change to
    what was not touched."""
    parsed(text.replace("\r\n", "\n"), str(path))
    try:
        same = tomlkit.dumps(tomlkit.parse(text)) == text
    except (TOMLKitError, ValueError) as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from None
    if not same:
        raise ConfigError(f"{path}: this file can't be edited here without changing its format: use a text editor")


def _at(document: Any, key: Key) -> Any:
    found = document
    for part in key:
        if not isinstance(found, Mapping) or part not in found:
            return None
        found = found[part]
    return found


def _table(document: Any, key: Key, new: Callable[[], Any]) -> Any:
    """The table at `key`, a `new` one where there is none."""
    found = document
    for part in key:
        if part not in found:
            found[part] = new()
        found = found[part]
    return found


def _shown(item: Any) -> str:
    if isinstance(item, str):
        return str(item)
    return item.as_string() if isinstance(item, Item) else json.dumps(item)  # a bool comes bare


def _change_items(array: Array, new: Sequence[Any]) -> None:
    """Put in and take out only what differs: the rows of an array, and comments in it, are somebody's order."""
    before, after = [_shown(item) for item in array], [_shown(item) for item in new]
    changes = SequenceMatcher(None, before, after, autojunk=False).get_opcodes()
    for what, i1, i2, j1, j2 in reversed(changes):
        if what == "equal":
            continue
        shared = min(i2 - i1, j2 - j1)
        for k in range(shared):
            array[i1 + k] = new[j1 + k]
        for _ in range(i2 - i1 - shared):
            del array[i1 + shared]
        for k in range(j2 - j1 - shared):
            array.insert(i1 + shared + k, new[j1 + shared + k])
