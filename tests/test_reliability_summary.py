"""Lines that tests left become count, median and worst of each promise; a failure is never quiet."""

import json

import pytest

from tests.reliability.page.promises_page import Promise
from tests.reliability.page.summary import BEGIN, END, put, state, summed, table, told

PAGE = (
    Promise(1, "it stops", "shown", ("tests/a.py::test_one", "tests/a.py::test_two")),
    Promise(2, "it is kept", "in part", ("tests/b.py",)),
    Promise(3, "it flies", "not done", ()),
)


def lines(*found):
    return [json.dumps(each) for each in found]


def number(value, test="tests/a.py::test_one"):
    return {"test": test, "what": "time to zero", "value": value, "unit": "s"}


def test_count_median_and_worst():
    one = {"test": "tests/a.py::test_one", "outcome": "passed"}
    found = summed(lines(one, number(0.1), number(0.5), one, number(0.2)), PAGE)["1"]
    assert found["measured"] == [{"what": "time to zero", "unit": "s", "count": 3, "median": 0.2, "worst": 0.5}]
    assert found["tests"] == {"passed": 2, "failed": 0, "not run": 1}
    assert told(found) == "time to zero: 3, median 200 ms, worst 500 ms"
    assert state(found) == "shown"


def test_a_whole_file_is_its_tests():
    passed = [{"test": f"tests/b.py::test_{name}", "outcome": "passed"} for name in "xy"]
    found = summed(lines(*passed), PAGE)
    assert (told(found["2"]), told(found["1"]), told(found["3"])) == ("2 tests passed", "not run", "")


def test_a_failure_is_said():
    found = summed(lines({"test": "tests/b.py::test_x", "outcome": "failed"}, number(3.0, "tests/b.py::test_x")), PAGE)
    assert told(found["2"]) == "time to zero: 3000 ms; 1 of 1 tests failed"
    assert state(found["2"]) == "**FAILED**"


def test_the_table_is_put_in_its_place():
    results = {"date": "d", "version": "v", "machine": "m", "promises": summed([], PAGE)}
    made = put(f"before\n{BEGIN}\nold\n{END}\nafter\n", results)
    assert made == f"before\n{table(results)}\nafter\n"
    assert "| 3 | it flies |  | not done |" in made
    assert put(made, results) == made
    with pytest.raises(ValueError, match="expected one table"):
        put("nothing", results)
