"""docs/reliability.md names tests; each is where the page says. Page, docs/reliability.json and README.md agree."""

from __future__ import annotations

import json
import re

from tests.reliability.page.promises_page import COUNT, PAGE, STATES, TESTS, named, promises
from tests.reliability.page.summary import put

TEXT = PAGE.read_text(encoding="utf-8")
PROMISES = promises(TEXT)
RESULTS = json.loads((PAGE.parent / "reliability.json").read_text(encoding="utf-8"))


def test_every_test_that_the_page_names_is_there() -> None:
    files = {path: path.read_text(encoding="utf-8") for path in TESTS.rglob("test_*.py")}
    seen = 0
    for where, name in named(TEXT):
        if not name:
            continue
        (text,) = [each for file, each in files.items() if file.as_posix().endswith(f"/{where}")]
        assert re.search(rf"^(async )?def {name}\(", text, re.MULTILINE), f"{where}::{name}"
        seen += 1
    assert seen > 60


def test_the_page_has_every_promise_with_its_tests() -> None:
    assert [promise.number for promise in PROMISES] == [*range(1, COUNT + 1)]
    assert {promise.state for promise in PROMISES} <= set(STATES)
    bare = [promise.number for promise in PROMISES if not promise.tests and promise.state != "not done"]
    assert bare == [], "what no test shows is not promised"


def test_the_json_has_the_promises_of_the_page() -> None:
    assert {"date", "machine", "version"} <= RESULTS.keys()
    told = {int(number): (entry["promise"], entry["state"]) for number, entry in RESULTS["promises"].items()}
    assert told == {promise.number: (promise.line, promise.state) for promise in PROMISES}, (
        "python benchmarks/controller/reliability.py --publish NUMBER writes both"
    )
    for entry in RESULTS["promises"].values():
        assert entry.keys() == {"promise", "state", "run", "tests", "measured"}
        assert all(each.keys() == {"what", "unit", "count", "median", "worst"} for each in entry["measured"])


def test_the_table_of_the_readme_is_made_of_the_json() -> None:
    readme = (PAGE.parents[1] / "README.md").read_text(encoding="utf-8")
    assert put(readme, RESULTS) == readme
    assert len(re.findall(r"^\| \d+ \| .* \|$", readme, re.MULTILINE)) == COUNT
