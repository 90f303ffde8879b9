"""`rig diagnose FILES --jobs N`: a row of each recording's own diagnosis; `--twin` of another is known by its bytes."""

import pyarrow.dataset
import pytest
from click.testing import CliRunner

from rig.diagnose.command import diagnose_command, diagnose_files
from tests.rig.fleet.small_recordings import folder, write


def rig_diagnose(*arguments):
    return CliRunner().invoke(diagnose_command, [str(each) for each in arguments], catch_exceptions=False)


def rows(store):
    found = pyarrow.dataset.dataset(str(store / "diagnoses"), partitioning="hive").to_table().to_pylist()
    return {row["recording_id"]: row for row in found}


def test_a_row_is_what_a_diagnosis_of_the_file_alone_says(tmp_path):
    root = folder(tmp_path / "fleet", 1)
    write(root / "weak.h5", 9, C=0.3)
    twin = tmp_path / "usual.json"
    alone = rig_diagnose(root / "0.h5", "--save-twin", twin)
    assert alone.exit_code == 0
    told = rig_diagnose(root, "--jobs", 1, "--store", tmp_path / "store", "--twin", twin, "--any-thruster")
    assert (told.exit_code, "2 files, 2 computed" in told.output) == (0, True)
    usual, weak = rows(tmp_path / "store")["id-0"], rows(tmp_path / "store")["id-9"]
    assert (usual["verdict"], usual["findings"]) == ("adequate", [])
    ours = diagnose_files([root / "weak.h5"], twin=twin, any_thruster=True)
    assert (weak["verdict"], weak["statement"]) == (ours.verdict, ours.statement)
    (named,) = weak["findings"]
    assert named["effect"] == "thrust_constant"
    again = rig_diagnose(root, "--jobs", 1, "--store", tmp_path / "store", "--twin", twin, "--any-thruster")
    assert "0 computed, 2 known" in again.output
    twin.write_text(twin.read_text() + "\n")
    assert (
        "2 computed, 0 known"
        in rig_diagnose(root, "--jobs", 1, "--store", tmp_path / "store", "--twin", twin, "--any-thruster").output
    )


@pytest.mark.parametrize("option", [("--report", "page.html"), ("--explain",), ("--mass", 10.0)])
def test_what_a_row_has_no_place_for_is_refused(option, tmp_path):
    root = folder(tmp_path / "fleet", 1)
    told = rig_diagnose(root, "--jobs", 1, *option)
    assert (told.exit_code, "not with --jobs" in told.output) == (2, True)


def test_no_twin_is_said_once(tmp_path):
    root = folder(tmp_path / "fleet", 2)
    told = rig_diagnose(root, "--jobs", 1, "--store", tmp_path / "store", "--twin", root / "0.h5")
    assert told.exit_code == 2
    assert told.output.count("0.h5") == 1
