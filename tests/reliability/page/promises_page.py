"""The 35 promises as docs/reliability.md has them: number, line, state, and the tests that its text names for each."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

TESTS: Final = Path(__file__).parents[2]
PAGE: Final = TESTS.parent / "docs" / "reliability.md"
COUNT: Final = 35
STATES: Final = ("shown", "in part", "not done")
NAMED: Final = re.compile(r"`(?:([\w/]*test_\w+\.py)|(?=::))(?:::(test_\w+))?")
"""A file, a test in it, or a test in the file that was named last."""
ROW: Final = re.compile(r"^\| (\d+) \| (.+?) \| (shown|in part|not done) \|$", re.MULTILINE)
SECTION: Final = re.compile(r"^\*\*(?:(\d+)\.)?", re.MULTILINE)
"""Where a promise's text begins; a bold line without a number ends it as well."""


class Promise(NamedTuple):
    """One row of the table and the text of its number."""

    number: int
    line: str
    state: str
    tests: tuple[str, ...]
    """Ids as pytest takes them, from the folder of the project."""


def named(text: str) -> Iterator[tuple[str, str]]:
    """(end of the file's path, test) of each test that a text names; an empty test: the file as a whole."""
    where = ""
    for path, name in NAMED.findall(text):
        where = path or where
        yield where, name


def promises(page: str) -> tuple[Promise, ...]:
    """Of the page, by number. KeyError: a row of its table has no text."""
    files = [path.relative_to(TESTS.parent).as_posix() for path in sorted(TESTS.rglob("test_*.py"))]
    starts = [*SECTION.finditer(page)]
    ends = [*(match.start() for match in starts[1:]), len(page)]
    texts = {int(m[1]): page[m.start() : end] for m, end in zip(starts, ends, strict=True) if m[1]}
    return tuple(
        Promise(int(number), line, state, tuple(_ids(texts[int(number)], files)))
        for number, line, state in ROW.findall(page)
    )


def _ids(text: str, files: list[str]) -> Iterator[str]:
    for where, name in dict.fromkeys(named(text)):
        (file,) = (each for each in files if each.endswith(f"/{where}"))
        yield f"{file}::{name}" if name else file
