"""The facts of campaign.jsonl: what each kind of fact tells, in which types. What is told otherwise is not believed."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from math import isfinite
from typing import Any, Final, NamedTuple

Fact = Mapping[str, Any]

LONGEST: Final = 16 * 2**20
"""Bytes of one line; the longest that is written holds a bench file and a campaign file."""


class Kind(NamedTuple):
    """What a field may hold."""

    said: str
    takes: Callable[[object], bool]


def _list_of(takes: Callable[[object], bool]) -> Callable[[object], bool]:
    return lambda value: isinstance(value, list) and all(map(takes, value))


def _is_text(value: object) -> bool:
    return isinstance(value, str)


def _is_whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_number(value: object) -> bool:
    return _is_whole(value) or (isinstance(value, float) and isfinite(value))


TEXT = Kind("a text", _is_text)
TEXTS = Kind("a list of texts", _list_of(_is_text))
WHOLE = Kind("a whole number", _is_whole)
WHOLES = Kind("a list of whole numbers", _list_of(_is_whole))
NUMBER = Kind("a finite number", _is_number)
FLOAT = Kind("a number", lambda value: _is_whole(value) or isinstance(value, float))
NUMBER_OR_NONE = Kind("a finite number or null", lambda value: value is None or _is_number(value))
TRUTH = Kind("true or false", lambda value: isinstance(value, bool))
NAMES = Kind("a table of texts", lambda value: isinstance(value, dict) and all(map(_is_text, value.values())))

BEGUN: Final[Mapping[str, Kind]] = {
    "campaign": TEXT, "thrusters": TEXTS, "identities": NAMES, "campaign_file": TEXT, "campaign_sha256": TEXT,
    "bench_sha256": TEXT, "campaign_toml": TEXT, "bench_toml": TEXT,
}  # fmt: skip
FIELDS: Final[Mapping[str, Mapping[str, Kind]]] = {
    "start": BEGUN,
    "resume": BEGUN,
    "kept": {"thruster": TEXT, "recordings": TEXTS, "continues": TEXT, "steps": WHOLES},
    "run_start": {
        "thruster": TEXT, "recording": TEXT, "recording_t0_ns": WHOLE, "attempt": WHOLE, "recording_id": TEXT,
    },
    "step": {"thruster": TEXT, "index": WHOLE, "phase": TEXT, "t_end": NUMBER},
    "mismatch": {
        "thruster": TEXT, "time": NUMBER, "began": FLOAT, "place": TEXT, "size_N": FLOAT, "e_value": FLOAT,
        "late": TRUTH,
    },
    "run_end": {
        "thruster": TEXT, "outcome": TEXT, "cause": TEXT, "recording": TEXT, "sha256": TEXT,
        "time_to_zero_s": NUMBER_OR_NONE,
    },
    "end": {"outcome": TEXT, "cause": TEXT},
}  # fmt: skip
"""Kind of fact -> its fields."""
LATER: Final = frozenset({("run_start", "recording_id")})
"""(kind, field) that ledgers of earlier versions lack."""


def fact_of(line: bytes) -> Fact:
    """The fact that a line of the ledger tells. Raises ValueError with what is wrong, as the end of a sentence."""
    if len(line) > LONGEST:
        raise ValueError(f"a line of {len(line)} bytes, where at most {LONGEST} are expected")
    try:
        fact = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"not a line of JSON ({error})") from None
    if not isinstance(fact, dict) or not isinstance(fact.get("fact"), str):
        raise ValueError("expected a JSON object with a text `fact`, which says what kind of fact it is")
    kind = fact["fact"]
    if kind not in FIELDS:
        raise ValueError(f"unknown fact {kind[:40]!r}; expected {', '.join(FIELDS)}")
    _require_fields(kind, fact, FIELDS[kind])
    return fact


def _require_fields(kind: str, fact: Fact, fields: Mapping[str, Kind]) -> None:
    for name in fact:
        if name != "fact" and name not in fields:
            raise ValueError(f"unknown field {name[:40]!r} of the fact {kind}; expected {', '.join(fields)}")
    for name, wanted in fields.items():
        if name not in fact:
            if (kind, name) in LATER:
                continue
            raise ValueError(f"the fact {kind} lacks its field {name}")
        if not wanted.takes(fact[name]):
            raise ValueError(f"{name} of the fact {kind} is {str(fact[name])[:40]!r}; expected {wanted.said}")
