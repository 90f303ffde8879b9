"""`rig fit FILES --jobs N`: a row of each recording in Parquet."""

import json
from pathlib import Path

import pyarrow.dataset
import pyarrow.parquet
import pytest
from click.testing import CliRunner

from rig.fit.answer import fit_files
from rig.fit.as_json import fit_json
from rig.fit.command import fit_command
from tests.rig.fleet.small_recordings import folder, write


def rig_fit(*arguments):
    return CliRunner().invoke(fit_command, [str(each) for each in arguments], catch_exceptions=False)


@pytest.fixture
def fleet(tmp_path) -> Path:
    """Three recordings of one day, one of another, and one that is no recording."""
    root = folder(tmp_path / "fleet", 3)
    write(root / "late.h5", 77, created="2026-11-27T10:00:00+00:00")
    (root / "torn.h5").write_bytes((root / "0.h5").read_bytes()[:5000])
    return root


def table(store):
    return pyarrow.dataset.dataset(str(store / "fits"), partitioning="hive").to_table().to_pylist()


def test_a_row_is_what_a_fit_of_the_file_alone_says(fleet, tmp_path):
    store = tmp_path / "store"
    told = rig_fit(fleet, "--jobs", 2, "--store", store)
    assert told.exit_code == 1
    assert "5 files, 5 computed, 0 known, 1 can't be used" in told.output
    rows = {row["recording_id"]: row for row in table(store)}
    (alone,) = fit_files([fleet / "late.h5"])
    known, row = fit_json(alone.fit), rows["id-77"]
    C = known["parameters"]["C"]
    assert (row["C"], row["C_std"], row["C_std_calibration"]) == (C["value"], C["std"], C["std_calibration"])
    assert (row["C_dof"], row["C_unit"], row["n"]) == (C["dof"], "N/V^2", known["n"])
    assert row["parameters"][0]["std_statistical"] == C["std_statistical"]
    assert row["tare"] == known["tare"]["id-77"]["value"]
    assert row["chi2_per_dof"] == known["chi2_per_dof"]
    assert abs(row["asymmetry"]) < 5 * row["asymmetry_std"]
    assert (row["thruster"], row["serial"], row["day"]) == ("T-00077", 77, "2026-11-27")
    assert "not underfitted" in row["verdicts"][0]
    assert rows[None]["error"].startswith(f"{fleet / 'torn.h5'} says it is a recording, but")


def test_units_are_in_the_metadata_of_the_fields(fleet, tmp_path):
    rig_fit(fleet / "0.h5", "--jobs", 1, "--store", tmp_path / "store")
    schema = pyarrow.parquet.read_schema(tmp_path / "store" / "fits" / "day=2026-11-26" / "rows.parquet")
    assert schema.field("tare").metadata == {b"unit": b"N"}
    assert json.loads(schema.metadata[b"thruster_rig"])["table"] == "fits"


def test_the_same_command_again_costs_no_fit_and_other_options_do(fleet, tmp_path):
    store = tmp_path / "store"
    rig_fit(fleet, "--jobs", 2, "--store", store)
    before = {path: path.stat().st_mtime_ns for path in store.rglob("*.parquet")}
    again = rig_fit(fleet, "--jobs", 2, "--store", store)
    assert "0 computed, 5 known, 1 can't be used" in again.output
    assert {path: path.stat().st_mtime_ns for path in store.rglob("*.parquet")} == before
    split = rig_fit(fleet / "1.h5", "--jobs", 1, "--store", store, "--model", "C+/C-")
    assert (split.exit_code, "1 computed" in split.output) == (0, True)
    rows = [row for row in table(store) if row["recording_id"] == "id-1"]
    assert {row["model"]: len(row["parameters"]) for row in rows} == {"C V|V|": 1, "C+/C-": 2}


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--jobs", 1, "--report", "x.html"), "--report: not with --jobs, which makes a row of each file"),
        (("--jobs", 1, "--one-pass"), "--one-pass, --in-memory: not with --jobs"),
        (("--store", "s"), "--store: only with --jobs"),
        (("--jobs", 1, "--limit", "nan"), "--limit must be above 0 s"),
    ],
)
def test_what_has_no_meaning_is_refused_before_anything_is_made(more, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    told = rig_fit(write(tmp_path / "a.h5", 1), *more)
    assert told.exit_code == 2
    assert said in told.output
    assert [path.name for path in tmp_path.iterdir()] == ["a.h5"]
