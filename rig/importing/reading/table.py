"""Text into rows of cells. A row that is not as the others is refused with its line number, never guessed."""

from __future__ import annotations

import csv
import difflib
import re
import unicodedata
from array import array
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final, Protocol

from rig.errors import RecordingError
from rig.importing.mapping import ColumnRef, FileMap, HeaderValue

LINE_END: Final = re.compile("\r\n|[\n\r\v\f\x1c-\x1e\x85\u2028\u2029]")
FIRST_LINES = 5
"""Line numbers kept per reason."""


@dataclass
class Refused:
    """Rows left out, per reason, with the first line numbers."""

    counts: Counter[str] = field(default_factory=Counter)
    lines: dict[str, list[int]] = field(default_factory=dict)

    def add(self, reason: str, line: int) -> None:
        self.counts[reason] += 1
        if self.counts[reason] <= FIRST_LINES:
            self.lines.setdefault(reason, []).append(line)

    def sentences(self) -> list[str]:
        return [f"{n} rows left out: {why} (lines {self._where(why)})" for why, n in self.counts.items()]

    def _where(self, reason: str) -> str:
        more = ", ..." if self.counts[reason] > FIRST_LINES else ""
        return ", ".join(map(str, self.lines[reason])) + more


class Lines:
    """Some lines of a text, each with its number: where they are, not what they hold, which is many times larger."""

    def __init__(self, text: str, form: FileMap, width: int = 0) -> None:
        self._text, self._form, self._width = text, form, width
        self._places = array("q")

    def add(self, number: int, start: int, end: int) -> None:
        self._places.extend((number, start, end))

    def __len__(self) -> int:
        return len(self._places) // 3

    def __iter__(self) -> Iterator[tuple[int, Sequence[str]]]:
        """Line number and cells, without empty ones beyond the width."""
        for number, start, end in self.places():
            yield number, _trimmed(split(self._text[start:end], self._form), self._width)

    def places(self, first: int = 0) -> Iterator[tuple[int, int, int]]:
        """Number, start and end of each line, from the `first` on."""
        for i in range(3 * first, len(self._places), 3):
            yield self._places[i], self._places[i + 1], self._places[i + 2]

    def of_width(self, width: int, first: int, refused: Refused) -> Lines:
        """Those with so many cells, from the `first` on; `refused` is told of the others."""
        good = Lines(self._text, self._form, width)
        for number, start, end in self.places(first):
            cells = len(_trimmed(split(self._text[start:end], self._form), width))
            if cells == width:
                good.add(number, start, end)
            else:
                refused.add(f"{'fewer' if cells < width else 'more'} than {width} columns", number)
        return good


class Rows(Protocol):
    """Rows of cells, each with the number of its line."""

    def __len__(self) -> int: ...

    def __iter__(self) -> Iterator[tuple[int, Sequence[str]]]: ...


@dataclass(frozen=True)
class Table:
    """The cells of a file, and what was found out about it on the way."""

    names: tuple[str, ...]
    """Of the header; empty without one."""
    rows: Rows
    """Line number and cells."""
    above: tuple[Sequence[str], ...]
    """Cells of comment and skipped lines."""
    width: int
    encoding: str
    latin: bool
    """The bytes were not in the encoding asked for, so latin-1 it is."""


def decode(data: bytes, encoding: str) -> tuple[str, str]:
    """Text and the encoding that was used: the one asked for, with or without byte-order mark, else latin-1."""
    try:
        return data.decode("utf-8-sig" if encoding.lower() in ("utf-8", "utf8") else encoding), encoding
    except UnicodeDecodeError:
        return data.decode("latin-1"), "latin-1"
    except LookupError as error:
        raise RecordingError(
            f"no encoding is called {encoding!r}; give for example utf-8, utf-16 or latin-1"
        ) from error


def read_table(data: bytes, form: FileMap, refused: Refused) -> Table:
    """Rows of the right width. `refused` is told of the others."""
    text, encoding = decode(data, form.encoding)
    above: list[Sequence[str]] = []
    body = Lines(text, form, len(text))
    for number, start, end in _lines(text):
        line = text[start:end]
        if not line.strip() or any(mark in line for mark in form.ignore):
            continue
        if number <= form.skip_rows or (form.comment and line.lstrip().startswith(form.comment)):
            above.append(list(split(line, form)))
        else:
            body.add(number, start, end)
    head = next(iter(body), None) if form.header else None
    names = tuple(_normal(cell) for cell in _trimmed(head[1], 0)) if head is not None else ()
    width = form.width or len(names) or _usual_width(body)
    good = body.of_width(width, 1 if head is not None else 0, refused)
    return Table(names, good, tuple(above), width, encoding, encoding != form.encoding)


def _lines(text: str) -> Iterator[tuple[int, int, int]]:
    """Number, start and end of each line, as `str.splitlines` cuts them."""
    start, number = 0, 0
    for number, found in enumerate(LINE_END.finditer(text), start=1):
        yield number, start, found.start()
        start = found.end()
    if start < len(text):
        yield number + 1, start, len(text)


def _trimmed(cells: Sequence[str], width: int) -> Sequence[str]:
    """Without empty cells beyond `width`: some programs end every line with a separator."""
    n = len(cells)
    while n > width and not cells[n - 1].strip():
        n -= 1
    return cells[:n]


def split(line: str, form: FileMap) -> Sequence[str]:
    """The cells of one line, quotes understood."""
    if form.delimiter == "whitespace":
        return line.split()
    mark = "\t" if form.delimiter == "tab" else form.delimiter
    return next(csv.reader([line], delimiter=mark)) if '"' in line else line.split(mark)


def _usual_width(body: Lines) -> int:
    counts = Counter(len(cells) for _, cells in body)
    return counts.most_common(1)[0][0] if counts else 0


def _normal(name: str) -> str:
    """Header text for comparison: the two Unicode micro signs are one, NFKC."""
    return unicodedata.normalize("NFKC", name).strip()


def index_of(table: Table, column: ColumnRef) -> int | None:
    """0-based place of a column, None when there is none of that name or number."""
    if isinstance(column, int):
        return column - 1 if 1 <= column <= table.width else None
    wanted = _normal(column)
    return table.names.index(wanted) if wanted in table.names else None


def no_such_column(table: Table, column: ColumnRef) -> RecordingError:
    """The error of a column that is not there, which names the nearest that is."""
    if isinstance(column, int) or not table.names:
        return RecordingError(f"column {column!r} is not there: rows have {table.width} columns, counted from 1")
    near = difflib.get_close_matches(column, table.names, 1, cutoff=0.4)
    hint = f"the nearest is {near[0]!r}" if near else f"there are {', '.join(map(repr, table.names))}"
    return RecordingError(f"no column is called {column!r}; {hint}; is this the right map?")


def header_value(table: Table, name: str, wanted: HeaderValue) -> float:
    """A number from the lines above the data. Raises RecordingError."""
    for cells in table.above:
        if cells[0].strip() == wanted.line and len(cells) >= wanted.field:
            try:
                return float(cells[wanted.field - 1])
            except ValueError as error:
                found = cells[wanted.field - 1]
                raise RecordingError(
                    f"{name}: field {wanted.field} of {wanted.line} is {found!r}, not a number"
                ) from error
    raise RecordingError(f"{name}: no line above the data starts with {wanted.line!r} and has {wanted.field} fields")
