"""Tables are read line by line: what an import takes are its numbers, not the objects that their texts were."""

import os
import tracemalloc

import pytest

from rig.errors import RecordingError
from rig.importing.mapping import build_map
from rig.importing.one_file import import_file, import_plain
from rig.importing.reading.table import Refused, read_table

FACTS = {"column": 2, "quantity": "thrust", "unit": "N"}
PLAN = {"about": "x", "thruster": "T1", "file": {"header": False}, "time": {"column": 1}}
PLAN |= {"streams": {"s": {"channels": {"thrust": FACTS}}}}


def test_an_import_takes_a_few_times_the_size_of_its_file(tmp_path):
    source = tmp_path / "log.csv"
    source.write_text("".join(f"{i / 100:.2f},{i % 97}.25,0.000000,0.000000,0.000000\n" for i in range(50_000)))
    tracemalloc.start()
    try:
        import_file(source, build_map(PLAN, "", "x"), tmp_path / "out.h5")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 8 * source.stat().st_size


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\x0b", "\u2028"])
def test_lines_are_those_of_python(end):
    form = build_map(PLAN, "", "x").file
    text = f"1,2{end}{end}3,4{end}5{end}6,7"
    table = read_table(text.encode(), form, refused := Refused())
    expected = [(n, line.split(",")) for n, line in enumerate(text.splitlines(), start=1) if line.count(",") == 1]
    assert [(number, list(cells)) for number, cells in table.rows] == expected
    assert len(table.rows) == 3
    assert refused.counts.total() == 1


def test_what_is_no_file_is_refused(tmp_path):
    os.mkfifo(tmp_path / "log.csv")
    with pytest.raises(RecordingError, match="is a pipe"):
        import_file(tmp_path / "log.csv", build_map(PLAN, "", "x"), tmp_path / "out.h5")


@pytest.mark.parametrize("text", ["[" * 100_000, '{"a": ' * 100_000, "9" * 5000], ids=range(3))
def test_json_without_end_is_refused(tmp_path, text):
    (tmp_path / "x.json").write_text(text)
    with pytest.raises(RecordingError, match="JSON"):
        import_plain(tmp_path / "x.json", tmp_path / "out.h5")
