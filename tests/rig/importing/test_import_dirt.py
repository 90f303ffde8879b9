"""Import: every kind of dirt in a file."""

import pytest

from rig.errors import RecordingError
from rig.importing.mapping import build_map
from rig.importing.one_file import import_file
from tests.rig.importing.small_imports import PLAIN, imported, plan, values


def test_bad_rows_are_counted_by_reason_with_line_numbers(tmp_path):
    text = "t,f\n0,1\n1\n2,x\n3,nan\n4,2\n3.5,3\n5,inf\nsoon,1\n6,4,4\n7,5\n8,6\n9,7\n10,8\n11,9\n12,10\n"
    summary, recording, found = imported(tmp_path, text, PLAIN)
    assert values(found["thrust"]) == [1, 2, 5, 6, 7, 8, 9, 10]
    assert (summary.rows, summary.bad) == (8, 7)
    understood, *left_out = summary.sentences
    assert understood.startswith("understood: time 't' in s, 8 rows over 12 s, a log (no command in it)")
    assert set(left_out) == {
        "1 rows left out: fewer than 2 columns (lines 3)",
        "1 rows left out: more than 2 columns (lines 10)",
        "2 rows left out: a cell is not a number (lines 4, 5)",
        "1 rows left out: time runs backwards (lines 7)",
        "1 rows left out: a cell is not a finite number (lines 8)",
        "1 rows left out: the time is not as the map says (lines 9)",
    }
    assert [event.level for event in recording.events] == ["info", *["warning"] * 6]


def test_a_file_that_is_mostly_bad_is_refused_and_leaves_nothing(tmp_path):
    with pytest.raises(RecordingError, match=r"in.csv: 7 of 8 rows are bad.*lines 3, 4, 5, 6, 7, \.\.\."):
        imported(tmp_path, "t,f\n0,1\n" + "1,x\n" * 7, PLAIN)
    with pytest.raises(RecordingError, match="no row of data"):
        imported(tmp_path, "t,f\n", PLAIN)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.csv"]


def test_a_recording_is_not_overwritten_and_a_missing_file_is_named(tmp_path):
    imported(tmp_path, "t,f\n0,1\n", PLAIN)
    with pytest.raises(RecordingError, match="never overwritten"):
        import_file(tmp_path / "in.csv", build_map(PLAIN, "", "test"), tmp_path / "out.h5")
    with pytest.raises(RecordingError, match="can't be read"):
        import_file(tmp_path / "no.csv", build_map(PLAIN, "", "test"), tmp_path / "new.h5")


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ({}, b"\xef\xbb\xbft,f\r\n0,1\r\n1,2\r\n"),
        ({"encoding": "utf-16"}, "t,f\n0,1\n1,2\n".encode("utf-16")),
        ({"delimiter": ";", "decimal": ","}, "t;f\n0,0;1,0\n1,0;2,0\n"),
        ({"delimiter": "tab"}, "t\tf\n0\t1\n1\t2\n"),
        ({"delimiter": "whitespace"}, "  t   f\n 0  1\n 1  2\n"),
        ({"comment": "%"}, "% made today\n% by hand\nt,f\n0,1\n1,2\n"),
        ({"skip_rows": 2}, "made today\nby,hand\nt,f\n0,1\n1,2\n"),
        ({}, 't,f,"a, note"\n0,1,"x, y"\n1,2,"z"\n'),
        ({}, "f,t\n1,5\n\n2,6\n"),
        ({}, "t,f,\n0,1\n1,2,\n"),
    ],
)
def test_separators_encodings_and_what_stands_above(tmp_path, file, text):
    _, _, found = imported(tmp_path, text, plan(file=file))
    assert values(found["thrust"]) == [1, 2]
    assert found["thrust"].time.tolist() == [0, 1]


def test_bytes_that_are_not_utf8_are_read_as_latin1_and_that_is_said(tmp_path):
    summary, _, found = imported(tmp_path, "t,f,°\n0,1,2\n".encode("latin-1"), PLAIN)
    assert values(found["thrust"]) == [1]
    assert "the file is not utf-8; read as latin-1" in summary.sentences
    with pytest.raises(RecordingError, match="no encoding is called 'utf-9'"):
        imported(tmp_path, "t,f\n0,1\n", plan(file={"encoding": "utf-9"}))


@pytest.mark.parametrize(
    ("clock", "cells", "seconds", "created"),
    [
        ({"unit": "ms"}, ("10", "1510"), 1.5, ""),
        ({"unit": "min"}, ("0", "2"), 120, ""),
        ({"format": "iso"}, ("2024-03-01T10:00:00+02:00", "2024-03-01T08:00:01.5Z"), 1.5, "2024-03-01T08:00:00+00:00"),
        ({"format": "iso"}, ("2024-03-01 10:00:00", "2024-03-01 10:00:03"), 3, ""),
        ({"format": "%H:%M:%S %z"}, ("10:00:00 +0100", "10:00:02 +0100"), 2, "1900-01-01T09:00:00+00:00"),
        ({"format": "%d.%m.%Y %H:%M"}, ("1.3.2024 10:00", "1.3.2024 10:01"), 60, ""),
    ],
)
def test_times(tmp_path, clock, cells, seconds, created):
    text = f"t,f\n{cells[0]},1\n{cells[1]},2\n"
    _, recording, found = imported(tmp_path, text, plan(time={"column": 1, **clock}))
    assert found["thrust"].time.tolist() == pytest.approx([0, seconds])
    assert recording.created == created
