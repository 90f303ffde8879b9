"""docs/reliability.md names tests; each is where the page says."""

from __future__ import annotations

import re
from pathlib import Path

TESTS = Path(__file__).parent
PAGE = (TESTS.parent / "docs" / "reliability.md").read_text(encoding="utf-8")
NAMED = re.compile(r"`(?:([\w/]*test_\w+\.py)|(?=::))(?:::(test_\w+))?")
"""A file, a test in it, or a test in the file that was named last."""


def test_every_test_that_the_page_names_is_there() -> None:
    files = {path: path.read_text(encoding="utf-8") for path in TESTS.rglob("test_*.py")}
    where, seen = "", 0
    for path, name in NAMED.findall(PAGE):
        where = path or where
        if not name:
            continue
        (text,) = [each for file, each in files.items() if file.as_posix().endswith(f"/{where}")]
        assert re.search(rf"^(async )?def {name}\(", text, re.MULTILINE), f"{where}::{name}"
        seen += 1
    assert seen > 60
