"""The keys of a campaign file that are edited as fields: what each holds, its unit, when it means something. Pure."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from types import NoneType
from typing import Any, Final, Literal, get_args, get_origin, get_type_hints

from rig.campaign.config import CampaignConfig
from rig.campaign.loading import DWELLS
from rig.campaign.plan import Plan, TareConfig
from rig.campaign.shapes import SHAPES
from rig.editing.document import Document, Key, items_of
from rig.errors import ConfigError
from rig.toml_tables import joined, typed

Holds = Literal["text", "number", "whole", "texts", "numbers", "choice"]

CAMPAIGN: Final = ("name", "thrusters", "bench", "output", "kind", "operator", "notes", "expected_C", "flow_speed",
                   "unattended", "prove_watchdog")  # fmt: skip
PACING: Final = ("repeats", "zero_every", "slew", "rest", "settle_water", "settle_reversal")
UNITS: Final[Mapping[str, str]] = {
    "max": "V", "min": "V", "voltages": "V", "durations": "s", "rate": "V/s", "amplitude": "V", "offset": "V",
    "frequencies": "Hz", "slew": "V/s", "rest": "s", "settle_water": "s", "settle_reversal": "s", "duration": "s",
    "settle": "s", "max_std_error": "N", "max_drift": "N/s", "expected_C": "N/V^2", "flow_speed": "m/s",
}  # fmt: skip
NUMBER: Final = re.compile(r"[+-]?(0|[1-9]\d*)(\.\d+)?([eE][+-]?\d+)?", re.ASCII)


@dataclass(frozen=True, slots=True)
class Field:
    """One key of the file."""

    key: Key
    holds: Holds
    hint: Any
    """Type that the loader wants."""
    choices: tuple[str, ...] = ()
    default: str = ""
    """In words, for a key that is not in the file; empty: it is required or has none."""

    @property
    def name(self) -> str:
        return self.key[-1]

    @property
    def dotted(self) -> str:
        """As the loader names it."""
        return ".".join(self.key)

    def one_line(self, document: Document) -> bool:
        """Whether its value fits into a field: not a table, nothing that is not shown as it is."""
        value = document.value(self.key)
        return not isinstance(value, dict) and document.written(self.key).isprintable()

    @property
    def unit(self) -> str:
        if self.key[:2] == ("plan", "dwell") and self.name in ("min", "max"):
            return "s"
        return UNITS.get(self.name, "")

    def toml(self, text: str) -> str:
        """What was typed, as TOML. What is no number becomes a text: the loader then says what it should have been."""
        match self.holds:
            case "number" | "whole":
                return _number(text)
            case "numbers":
                return f"[{', '.join(_number(part) for part in items_of(text))}]"
            case "texts":
                return f"[{', '.join(_quoted(part) for part in items_of(text))}]"
            case "choice":
                return text if text in ("true", "false") else _quoted(text)
        return _quoted(text)

    def fault(self, document: Document, path: Path) -> str:
        """What the loader says of this value alone; empty when it takes it, or there is none."""
        value = document.value(self.key)
        try:
            if value is not None:
                typed(self.hint, value, path, joined(".".join(self.key[:-1]), self.name))
        except ConfigError as error:
            return str(error)
        return ""


def _number(text: str) -> str:
    """As it was typed where TOML takes it; `.5`, `12.` and `012` as TOML writes them."""
    text = text.strip()
    if NUMBER.fullmatch(text):
        return text
    for kind in (int, float):
        try:
            return repr(kind(text))
        except ValueError:
            continue
    return _quoted(text)


def _quoted(text: str) -> str:
    """A TOML string: JSON's escapes are TOML's, but for the delete character."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def every_field() -> tuple[Field, ...]:
    """Of all shapes and dwells, each key once, in the order of a form."""
    found: dict[Key, Field] = {}
    for field in _every():
        found.setdefault(field.key, field)
    return tuple(found.values())


def _every() -> Iterator[Field]:
    yield from _of(CampaignConfig, ("campaign",), CAMPAIGN)
    yield Field(("plan", "kind"), "choice", Literal[tuple(SHAPES)], tuple(SHAPES))
    for shape in SHAPES.values():
        yield from _of(shape, ("plan",))
    yield from _of(Plan, ("plan",), PACING)
    yield Field(("plan", "dwell", "kind"), "choice", Literal[tuple(DWELLS)], tuple(DWELLS))
    for dwell in DWELLS.values():
        yield from _of(dwell, ("plan", "dwell"))
    yield from _of(TareConfig, ("tare",))


def _of(cls: type[Any], table: Key, names: tuple[str, ...] = ()) -> Iterator[Field]:
    hints = get_type_hints(cls)
    known = {each.name: each for each in fields(cls)}
    for name in names or tuple(known):
        hint = str if name == "bench" else hints[name]
        holds, choices = _kind(hint)
        if (*table, name) == ("campaign", "kind"):
            holds, choices = "choice", ("tunnel", "bollard")
        yield Field((*table, name), holds, hint, choices, _default(known[name]))


def _kind(hint: Any) -> tuple[Holds, tuple[str, ...]]:
    parts = [each for each in get_args(hint) if each is not NoneType]
    if get_origin(hint) is Literal:
        return "choice", tuple(str(each) for each in parts)
    if get_origin(hint) is tuple:
        return ("numbers" if parts[0] is float else "texts"), ()
    plain = parts[0] if parts else hint
    if plain is bool:
        return "choice", ("false", "true")
    return ("number" if plain is float else "whole" if plain is int else "text"), ()


def _default(field: Any) -> str:
    value = field.default
    if value is MISSING or value is None or value in ("", ()):
        return ""
    return str(value).lower() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else str(value)


def meant(field: Field, document: Document) -> bool:
    """Whether the loader knows this key beside the plan's and the dwell's kind; one that is there is shown anyway."""
    if field.key[0] != "plan" or field.name == "kind" or field.key[1] in PACING:
        return field.key != ("plan", "dwell", "kind") or _has_holds(document)
    if document.value(field.key) is not None:
        return True
    kinds = DWELLS if field.key[1] == "dwell" else SHAPES
    kind = document.value((*field.key[:-1], "kind"))
    known = kinds.get(kind) if isinstance(kind, str) else None
    if field.key[1] == "dwell" and not _has_holds(document):
        return False
    return known is not None and field.name in {each.name for each in fields(known)}


def _has_holds(document: Document) -> bool:
    return document.value(("plan", "kind")) not in ("ramp", "sine") or document.value(("plan", "dwell")) is not None


def changed(document: Document, field: Field, text: str) -> Document:
    """With what was typed into a field; an empty field takes its key out.

    Another kind of plan or dwell takes out the keys that only the one before had.
    """
    if not text.strip():
        return document.without(field.key)
    before = document
    document = document.with_value(field.key, field.toml(text))
    return _without_the_former(before, document, field) if field.key[0] == "plan" and field.name == "kind" else document


def _without_the_former(before: Document, document: Document, field: Field) -> Document:
    kinds: Mapping[str, type[Any]] = DWELLS if len(field.key) == 3 else SHAPES
    old, new = kinds.get(str(before.value(field.key))), kinds.get(str(document.value(field.key)))
    if old is None or new is None:
        return document
    for name in {each.name for each in fields(old)} - {each.name for each in fields(new)}:
        document = document.without((*field.key[:-1], name))
    return document
