"""`rig import FILES --jobs N`: a recording of each file, and a row that says what was understood."""

import pyarrow.parquet
import pytest
from click.testing import CliRunner

from rig.errors import ConfigError
from rig.hdf5 import load
from rig.importing.command import import_command

MAP = """about = "a bench's own table"
[time]
column = "t"
unit = "s"
[streams.cell]
[streams.cell.channels.thrust]
quantity = "thrust"
column = "F"
unit = "N"
[streams.command]
changes = true
[streams.command.channels.command_voltage]
quantity = "command_voltage"
column = "U"
unit = "V"
"""


def rig_import(*arguments):
    return CliRunner().invoke(import_command, [str(each) for each in arguments], catch_exceptions=False)


@pytest.fixture
def logs(tmp_path):
    """Three tables, and one that is none."""
    folder = tmp_path / "logs"
    folder.mkdir()
    for unit in (1, 2, 3):
        rows = [f"{0.1 * i:.1f},{i % 7},{0.4 * unit * (i % 7) ** 2:.3f}" for i in range(70)]
        (folder / f"run_T{unit}.csv").write_text("\n".join(["t,U,F", *rows]))
    (folder / "run_T4.csv").write_text("nothing\n")
    (tmp_path / "bench.toml").write_text(MAP)
    return folder


def imported(logs, *more):
    root = logs.parent
    return rig_import(
        logs, "--map", root / "bench.toml", "--jobs", 2, "--store", root / "store", "-o", root / "out", *more
    )


def table(logs):
    (file,) = (logs.parent / "store" / "imports").glob("*/*.parquet")
    return {row["url"].rpartition("/")[2]: row for row in pyarrow.parquet.ParquetFile(file).read().to_pylist()}


def test_each_file_becomes_a_recording_and_a_row(logs):
    told = imported(logs)
    assert told.exit_code == 1
    assert "4 files, 4 computed, 0 known, 1 can't be used" in told.output
    rows = table(logs)
    row = rows["run_T2.csv"]
    recording = load(logs.parent / "out" / "run_T2.h5")
    assert row["recording"] == str(logs.parent / "out" / "run_T2.h5")
    assert (row["thruster"], row["known_by"], row["rows"], row["left_out"]) == ("T2", "the file's name", 70, 0)
    assert (row["serial"], row["recording_id"]) == (2, recording.recording_id)
    assert recording.thruster == "T2"
    assert recording.attributes["imported_from"] == "run_T2.csv"
    assert any("command" in sentence for sentence in row["sentences"])
    assert rows["run_T4.csv"]["error"].startswith("run_T4.csv: ")
    assert not (logs.parent / "out" / "run_T4.h5").exists()


def test_again_costs_nothing_and_what_was_removed_is_made_again(logs):
    imported(logs)
    out = logs.parent / "out"
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    assert "4 files, 0 computed, 4 known" in imported(logs).output
    (out / "run_T1.h5").unlink()
    assert "4 files, 1 computed, 3 known" in imported(logs).output
    assert load(out / "run_T1.h5").recording_id == table(logs)["run_T1.csv"]["recording_id"]
    assert {path.name for path in out.iterdir()} == set(before)


def test_a_recording_that_is_there_stays_as_it_is(logs):
    """A worker that was killed behind its file is asked again; another import is refused."""
    imported(logs)
    root = logs.parent
    before = (root / "out" / "run_T1.h5").read_bytes()
    (root / "store" / "rows.sqlite").unlink()
    assert "4 computed, 0 known, 1 can't be used" in imported(logs).output
    assert (root / "out" / "run_T1.h5").read_bytes() == before
    told = imported(logs, "--where", "U > 1")
    assert "4 can't be used" in told.output
    assert "run_T1.h5 exists, and is another recording, which is never overwritten" in told.output
    assert (root / "out" / "run_T1.h5").read_bytes() == before


def test_what_would_be_one_recording_twice_is_refused_before_anything_is_written(logs):
    other = logs.parent / "more"
    other.mkdir()
    (other / "run_T1.csv").write_text((logs / "run_T1.csv").read_text())
    with pytest.raises(ConfigError, match=r"run_T1.csv and .*run_T1.csv would both become .*out/run_T1.h5"):
        imported(logs, other)
    assert not (logs.parent / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["a.csv", "b.csv"], "2 files were given: --jobs N imports each by itself"),
        (["a.csv", "--jobs", "2"], "--jobs: give --map too"),
        (["a.csv", "--jobs", "2", "--map", "effort_static", "--with", "b.csv"], "--with: not with --jobs"),
        (["a.csv", "--store", "x"], "--store: only with --jobs"),
    ],
)
def test_what_has_no_meaning_is_refused(arguments, says):
    with pytest.raises(ConfigError, match=says):
        rig_import(*arguments)
