"""`rig export`: what another library reads of each format is what the recording has, number by number."""

from __future__ import annotations

import csv
import json
import math
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import loadmat

from rig.cli import main
from rig.exporting import csv_folder
from rig.exporting.content import content_of
from rig.exporting.targets import TARGETS
from rig.hdf5 import load, stream_rows
from rig.workers.called import called
from tests.rig.exporting.conftest import EVENT
from tests.rig.hdf5.plain_files import plain
from tests.rig.hdf5.test_hdf5_recover import left_open, uneven

ThirdParty = Callable[[str], Any]
Columns = dict[str, np.ndarray[Any, Any]]


def expected(path: Path) -> dict[str, Columns]:
    """What `load` has of each stream."""
    found: dict[str, Columns] = {}
    for channel in load(path).channels:
        found.setdefault(channel.stream, {"time": channel.time})[channel.name] = channel.value
    return found


def exported(path: Path, word: str, *more: str) -> Path:
    out = path.with_name(f"out-{word}")
    assert main(["export", str(path), "--to", word, "-o", str(out), *more]) == 0
    return out


def assert_equal(found: dict[str, Columns], path: Path) -> None:
    """To the last bit, gaps included."""
    known = expected(path)
    assert list(found) == list(known)
    for stream, columns in known.items():
        assert list(found[stream]) == list(columns)
        for name, values in columns.items():
            np.testing.assert_array_equal(found[stream][name], values, err_msg=f"{stream}/{name}")


def csv_rows(path: Path) -> list[list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def csv_columns(path: Path) -> Columns:
    """Names without their units."""
    head, *rows = csv_rows(path)
    numbers = np.array([[float(cell) if cell else math.nan for cell in row] for row in rows])
    return {name.split(" [")[0]: numbers[:, k] for k, name in enumerate(head)}


def csv_tables(out: Path, path: Path) -> dict[str, Columns]:
    return {stream: csv_columns(out / "streams" / f"{stream}.csv") for stream in expected(path)}


@pytest.mark.parametrize("rows_at_a_time", [2**18, 10])
def test_csv(recording: Path, rows_at_a_time: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stream_rows, "ROWS_AT_A_TIME", rows_at_a_time)
    out = exported(recording, "csv")
    assert_equal(csv_tables(out, recording), recording)
    assert csv_rows(out / "streams" / "load_cell.csv")[0] == ["time [s]", "thrust [N]", "raw [1]"]
    assert csv_rows(out / "streams" / "load_cell.csv")[4][1] == ""
    assert csv_rows(out / "steps.csv") == [
        ["index", "phase", "command_voltage [V]", "t_start [s]", "t_end [s]"],
        ["-1", "free", "0.0", "0.0", "0.25"],
        ["0", "hold", "5.0", "0.25", "1.0"],
    ]
    assert csv_rows(out / "events.csv")[:2] == [["time [s]", "level", "text"], ["-0.5", "info", EVENT]]
    header = json.loads((out / "header.json").read_text(encoding="utf-8"))
    assert (header["thruster"], header["outcome"], header["bench_toml"]) == ("T1", "tripped", "[bench]\n")
    cell = header["streams"]["load_cell"]
    assert cell["device_id"] == "WMS 123"
    thrust = {"quantity": "thrust", "unit": "N", "noise_std": 0.02, "calibration": {"role": "primary"}}
    assert thrust.items() <= cell["columns"]["thrust"].items()
    assert "until the next row" in header["streams"]["command"]["columns"]["command_voltage"]["rows"]


def test_parquet(recording: Path, third_party: ThirdParty, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stream_rows, "ROWS_AT_A_TIME", 40)
    parquet = third_party("pyarrow.parquet")
    out = exported(recording, "parquet")
    tables = {stream: parquet.read_table(out / "streams" / f"{stream}.parquet") for stream in expected(recording)}
    found = {
        stream: {name: table[name].to_numpy(zero_copy_only=False) for name in table.column_names}
        for stream, table in tables.items()
    }
    assert_equal(found, recording)
    cell = tables["load_cell"]
    assert [cell[name].null_count for name in cell.column_names] == [0, 1, 1]
    thrust = cell.schema.field("thrust").metadata
    assert (thrust[b"unit"], thrust[b"quantity"], thrust[b"noise_std"]) == (b"N", b"thrust", b"0.02")
    assert cell.schema.field("time").metadata[b"unit"] == b"s"
    assert json.loads(cell.schema.metadata[b"thruster_rig"])["thruster"] == "T1"
    steps = parquet.read_table(out / "steps.parquet").to_pylist()
    assert steps[0] == {"index": -1, "phase": "free", "command_voltage": 0.0, "t_start": 0.0, "t_end": 0.25}
    assert parquet.read_table(out / "events.parquet")["text"][0].as_py() == EVENT


def test_mat(recording: Path) -> None:
    out = exported(recording, "mat")
    found = loadmat(out, simplify_cells=True, appendmat=False)
    matlab = {"load_cell": "load_cell", "2nd flow": "x2nd_flow", "command": "command"}
    assert_equal({name: found["streams"][matlab[name]] for name in expected(recording)}, recording)
    assert found["units"]["load_cell"] == {"time": "s", "thrust": "N", "raw": "1"}
    assert found["steps"]["index"].tolist() == [-1, 0]
    assert found["steps"]["phase"].tolist() == ["free", "hold"]
    assert found["events"]["text"][0] == EVENT
    header = found["header"]
    assert (header["thruster"], header["water_density"], header["complete"]) == ("T1", 998.2, 1)
    assert header["streams"]["load_cell"]["columns"]["thrust"]["calibration"] == {"role": "primary"}
    assert loadmat(out, appendmat=False)["streams"]["load_cell"][0, 0]["thrust"][0, 0].shape == (101, 1)


def test_mcap(recording: Path, third_party: ThirdParty) -> None:
    make_reader = third_party("mcap.reader").make_reader
    found: dict[str, list[dict[str, Any]]] = {}
    with exported(recording, "mcap").open("rb") as file:
        reader = make_reader(file)
        schemas = {}
        for schema, channel, message in reader.iter_messages():
            found.setdefault(channel.topic, []).append(json.loads(message.data))
            schemas[channel.topic] = (schema.name, schema.encoding, json.loads(schema.data)["properties"])
            if channel.topic.startswith("/streams"):
                assert message.log_time == 1795548547478776000 + round(found[channel.topic][-1]["time"] * 1e9)
        attached = {each.name: each.data.decode() for each in reader.iter_attachments()}
        (metadata,) = (each.metadata for each in reader.iter_metadata())
    tables = {
        stream: {name: np.array([row.get(name, math.nan) for row in found[f"/streams/{stream}"]]) for name in columns}
        for stream, columns in expected(recording).items()
    }
    assert_equal(tables, recording)
    name, encoding, fields = schemas["/streams/load_cell"]
    assert (name, encoding) == ("streams.load_cell", "jsonschema")
    assert fields["thrust"]["unit"] == "N"
    assert {field["type"] for field in fields.values()} == {"number"}  # one that Foxglove takes
    assert [len([r for r in found["/streams/load_cell"] if n not in r]) for n in ("thrust", "raw")] == [1, 1]
    assert schemas["/events"][0] == "foxglove.Log"
    first = found["/events"][0]
    assert (first["level"], first["message"], first["time"]) == (2, EVENT, -0.5)
    assert [step["phase"] for step in found["/steps"]] == ["free", "hold"]
    assert attached["bench.toml"] == "[bench]\n"
    assert json.loads(attached["header.json"])["streams"]["load_cell"]["device_id"] == "WMS 123"
    assert (metadata["thruster"], metadata["complete"]) == ("T1", "true")


def test_some_streams_only(recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = exported(recording, "csv", "--streams", "load_cell", "command")
    assert {path.stem for path in (out / "streams").iterdir()} == {"load_cell", "command"}
    assert set(json.loads((out / "header.json").read_text())["streams"]) == {"load_cell", "command"}
    assert "load_cell: 101 rows of time [s], thrust [N], raw [1]\n" in capsys.readouterr().out


def test_rows_that_cannot_be_used_are_left_out_and_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = plain(tmp_path / "a.h5")
    with h5py.File(path, "a") as file:
        del file["streams/cell/time"], file["streams/cell/thrust"]
        file["streams/cell/time"] = [0.0, 2.0, 1.0, np.nan, 1.5, 2.0, 3.0]
        file["streams/cell/thrust"] = np.arange(7.0)
    monkeypatch.setattr(stream_rows, "ROWS_AT_A_TIME", 2)
    out = exported(path, "csv")
    assert_equal(csv_tables(out, path), path)
    assert csv_columns(out / "streams" / "cell.csv")["thrust"].tolist() == [0.0, 1.0, 5.0, 6.0]
    assert "cell: 4 rows of time [s], thrust, 3 left out: time not finite or running back" in capsys.readouterr().out


def test_what_a_killed_writer_left(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = left_open(tmp_path / "r.h5", uneven)
    out = exported(path, "csv")
    assert_equal(csv_tables(out, path), path)
    assert "not closed in order, or still being written" in capsys.readouterr().out


def test_a_header_of_odd_numbers_is_json(tmp_path: Path) -> None:
    out = exported(plain(tmp_path / "a.h5", depth=np.nan, gains=[1.0, np.inf], thruster="T1"), "csv")
    header = json.loads((out / "header.json").read_text(), parse_constant=pytest.fail)
    assert (header["depth"], header["gains"], header["thruster"]) == (None, [1.0, None], "T1")


def test_a_stream_whose_name_is_no_file_name_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = plain(tmp_path / "a.h5")
    with h5py.File(path, "a") as file:
        file.move("streams/cell", "streams/..cell")
    assert main(["export", str(path), "--to", "csv"]) == 2
    assert "can't be called '..cell'" in capsys.readouterr().err
    assert [each.name for each in tmp_path.iterdir()] == ["a.h5"]
    assert main(["export", str(path), "--to", "mat"]) == 0
    assert main(["export", str(path), "--to", "csv", "--streams", "drive"]) == 0


def test_the_table_has_a_writer_for_every_word() -> None:
    assert [word for word, target in TARGETS.items() if target.of == "recording"] == ["csv", "parquet", "mat", "mcap"]
    assert all(callable(called(target.writer)) for target in TARGETS.values())
    assert all(callable(called(target.carried)) for target in TARGETS.values() if target.of == "twin")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("T1.h5", "--to", "csv", "-o", "T1.h5"), "T1.h5 exists; an export is never written over anything"),
        (("T1.h5", "--to", "mat", "-o", "no/T1.mat"), "there is no folder no"),
        (("T1.h5", "--to", "csv", "--streams", "flow"), "no such stream; it has load_cell, 2nd flow, command"),
        (("T2.h5", "--to", "csv"), "T2.h5 is no file"),
        (
            ("twin.json", "--to", "csv"),
            "this takes a recording, but twin.json is a twin; a twin goes to table",
        ),
        (("text.json", "--to", "mat"), "text.json is nothing that the rig makes"),
    ],
)
def test_refusals(
    recording: Path,
    arguments: tuple[str, ...],
    told: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(recording.parent)
    Path("twin.json").write_text('{"format": "thruster-rig-twin", "version": 1}')
    Path("text.json").write_text('{"a": 1}')
    before = sorted(Path().iterdir())
    assert main(["export", *arguments]) == 2
    assert told in capsys.readouterr().err
    assert sorted(Path().iterdir()) == before


def test_a_package_that_is_not_there_is_named_with_its_extra(
    recording: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(TARGETS, "parquet", TARGETS["parquet"]._replace(needs="no_such_package"))
    assert main(["export", str(recording), "--to", "parquet"]) == 2
    assert "which is not installed: pip install 'thruster-rig[parquet]'" in capsys.readouterr().err


def test_memory_does_not_grow_with_the_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the reading itself, which is done in a child otherwise, where tracemalloc does not look."""
    monkeypatch.setattr(stream_rows, "apart", lambda work, path: work())
    monkeypatch.setattr(stream_rows, "open_no_more", lambda: None)
    monkeypatch.setattr(stream_rows, "ROWS_AT_A_TIME", 2000)
    peaks = []
    for n in (20_000, 80_000):
        path = plain(tmp_path / f"{n}.h5")
        with h5py.File(path, "a") as file:
            del file["streams/cell/time"], file["streams/cell/thrust"]
            file["streams/cell/time"] = np.arange(n) / 1000
            file["streams/cell/thrust"] = np.arange(n) / 7
        content = content_of(path)
        tracemalloc.start()
        csv_folder.write(content, tmp_path / str(n))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0]
