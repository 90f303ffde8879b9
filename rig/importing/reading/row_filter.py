"""Which rows of a table are wanted: comparisons of columns with numbers or texts, and nothing else: no code is run.

    where = "mode == 'run' and [Thrust (N)] >= 0 or c3 != 0"

A column is a name, a name in square brackets when it is no plain word, or `c3` by its number. `and` binds before `or`.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from rig.errors import ConfigError, RecordingError

COMPARE: Final[dict[str, Callable[[Any, Any], bool]]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<=": operator.le,
    ">=": operator.ge,
    "<": operator.lt,
    ">": operator.gt,
}
ONE: Final = re.compile(
    r"""\s*(?:\[(?P<bracketed>[^\]]*(?:\[[^\]]*\])?[^\[\]]*)\]|(?P<plain>[^\W\d]\w*))\s*(?P<op>==|!=|<=|>=|<|>)\s*"""
    r"""(?:'(?P<single>[^']*)'|"(?P<double>[^"]*)"|(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?))\s*"""
)
JOIN: Final = re.compile(r"(and|or)\b")


@dataclass(frozen=True, slots=True)
class Comparison:
    """One column against one number or text."""

    column: str
    op: str
    value: float | str

    def holds(self, cell: str, comma: bool) -> bool:
        """Whether a cell is as asked. Raises ValueError where a number is asked for and the cell holds none."""
        if isinstance(self.value, str):
            return COMPARE[self.op](cell.strip(), self.value)
        return COMPARE[self.op](float(cell.strip().replace(",", ".") if comma else cell), self.value)


Filter = tuple[tuple[Comparison, ...], ...]
"""Alternatives, each a tuple of comparisons that must all hold."""


def parse(text: str) -> Filter:
    """Raises ConfigError that says where the text is no filter.

    >>> parse("mode == 'run' and c3 > 0.5 or [Thrust (N)] < -1")[1]
    (Comparison(column='Thrust (N)', op='<', value=-1.0),)
    """
    alternatives: list[list[Comparison]] = [[]]
    at = 0
    while True:
        found = ONE.match(text, at)
        if found is None:
            raise _wrong(text, at)
        alternatives[-1].append(_comparison(found, text))
        at = found.end()
        if at == len(text):
            return tuple(tuple(one) for one in alternatives)
        joined = JOIN.match(text, at)
        if joined is None:
            raise _wrong(text, at)
        if joined.group() == "or":
            alternatives.append([])
        at = joined.end()


def _comparison(found: re.Match[str], text: str) -> Comparison:
    column = found["plain"] if found["plain"] is not None else found["bracketed"].strip()
    if found["number"] is not None:
        return Comparison(column, found["op"], float(found["number"]))
    if found["op"] not in ("==", "!="):
        raise ConfigError(f"filter {text!r}: a text is compared with == or != only, not with {found['op']}")
    return Comparison(column, found["op"], found["single"] if found["single"] is not None else found["double"])


def _wrong(text: str, at: int) -> ConfigError:
    return ConfigError(
        f"filter {text!r}: can't be read from {text[at:].strip() or 'its end'!r} on; write comparisons of a column "
        "with a number or a text, joined by and/or: mode == 'run' and [Thrust (N)] >= 0"
    )


def columns_of(wanted: Filter) -> tuple[str, ...]:
    """Names of the columns that a filter looks at, each once."""
    return tuple(dict.fromkeys(one.column for alternative in wanted for one in alternative))


def row_passes(wanted: Filter, cells: Sequence[str], places: dict[str, int], comma: bool) -> bool:
    """Whether a row is wanted. Raises ValueError where a cell to be compared with a number holds none."""
    return any(all(c.holds(cells[places[c.column]], comma) for c in alternative) for alternative in wanted)


def refuse_empty(text: str, kept: int, rows: int) -> None:
    """Raises RecordingError where no row is left."""
    if rows and not kept:
        raise RecordingError(f"no row of {rows} is as `where = {text}` asks; is the column or the value another?")
