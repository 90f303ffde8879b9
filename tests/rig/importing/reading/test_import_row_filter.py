"""The row filter: a small grammar, nothing run, and clear sentences where it can't be read or leaves nothing."""

import pytest

from rig.errors import ConfigError, RecordingError
from rig.importing.reading.row_filter import Comparison, columns_of, parse, row_passes
from tests.rig.importing.small_imports import imported, plan, values

TEXT = "t,f,mode,Thrust (N),k\n0,1,run,5,1\n1,2,tare,6,2\n2,3,run,-7,3\n3,4,stop,8,4\n"


@pytest.mark.parametrize(
    ("where", "kept"),
    [
        ("mode == 'run'", [1, 3]),
        ('mode != "run"', [2, 4]),
        ("f > 2", [3, 4]),
        ("f >= 2 and f < 4", [2, 3]),
        ("[Thrust (N)] <= -1e0", [3]),
        ("c5 == 2 or mode == 'stop'", [2, 4]),
        ("mode == 'run' and f < 2 or k == 4.0", [1, 4]),
        ("f>1and k<4", [2, 3]),
    ],
)
def test_rows_that_are_wanted(tmp_path, where, kept):
    summary, _, found = imported(tmp_path, TEXT, plan(file={"where": where}))
    assert values(found["thrust"]) == kept
    assert f"{4 - len(kept)} rows left out by the filter: {where}" in summary.sentences
    assert summary.bad == 0


@pytest.mark.parametrize(
    "where",
    ["f >", "> 2", "f = 2", "f > 2 nor k < 3", "f > 2 and", "__import__('os')", "f > k", "f + 1 > 2", "(f > 2)", ""],
)
def test_what_is_no_filter_is_refused(where):
    with pytest.raises(ConfigError, match="write comparisons of a column with a number or a text"):
        parse(where)


def test_a_text_is_not_ordered():
    with pytest.raises(ConfigError, match="compared with == or != only, not with <"):
        parse("mode < 'run'")


def test_a_map_with_a_wrong_filter_names_the_key(tmp_path):
    with pytest.raises(ConfigError, match=r"test: file\.where: filter 'f >'"):
        imported(tmp_path, TEXT, plan(file={"where": "f >"}))


def test_a_filter_names_its_column_and_never_leaves_nothing(tmp_path):
    with pytest.raises(RecordingError, match="no column is called 'mod'; the nearest is 'mode'"):
        imported(tmp_path, TEXT, plan(file={"where": "mod == 'run'"}))
    with pytest.raises(RecordingError, match="no row of 4 is as `where = mode == 'Run'` asks"):
        imported(tmp_path, TEXT, plan(file={"where": "mode == 'Run'"}))


def test_a_cell_that_is_no_number_is_a_bad_row(tmp_path):
    text = TEXT + "4,5,run,x,5\n"
    summary, _, found = imported(tmp_path, text, plan(file={"where": "[Thrust (N)] > 0"}))
    assert values(found["thrust"]) == [1, 2, 4]
    assert "1 rows left out: the filter compares a cell with a number that is none (lines 6)" in summary.sentences


def test_numbers_are_read_as_the_file_writes_them():
    wanted = parse("a >= 1.5 and b == 'x y'")
    assert columns_of(wanted) == ("a", "b")
    assert wanted[0][0] == Comparison("a", ">=", 1.5)
    assert row_passes(wanted, ["1,5", " x y "], {"a": 0, "b": 1}, comma=True)
    assert not row_passes(wanted, ["1,4", "x y"], {"a": 0, "b": 1}, comma=True)
