"""`rig fit` of what a killed writer left: it says so, and of a damaged file and its copy it takes the copy."""

import h5py
import pytest
from click.testing import CliRunner

from rig.diagnose.command import recordings_in
from rig.errors import RecordingError
from rig.recording.recover import recover_command
from rig.vehicle.recordings import load_named
from tests.rig.fit.test_fit import run, write
from tests.rig.hdf5.test_hdf5_recover import left_open


def unclosed(path):
    """A recording of which another program was killed."""
    whole = write(path.with_suffix(".whole"))

    def fill(file):
        with h5py.File(whole, "r") as source:
            file.attrs.update(dict(source.attrs) | {"complete": False, "outcome": "running"})
            source.copy("streams", file)

    return left_open(path, fill)


def recovered(path):
    assert CliRunner().invoke(recover_command, [str(path)], catch_exceptions=False).exit_code == 0
    return path.with_name(f"{path.stem}-recovered.h5")


def test_what_may_be_lost_of_a_killed_file_is_said(tmp_path):
    result = run(unclosed(tmp_path / "T3.h5"))
    assert result.exit_code == 0
    assert "T3.h5 was not closed in order, or is still being written" in result.output
    assert "what came in the last 0.5 s may be lost; rig recover T3.h5 makes a plain copy" in result.output


def test_the_same_in_one_pass(tmp_path):
    assert "T3.h5 was not closed in order" in run(unclosed(tmp_path / "T3.h5"), "--one-pass").output


@pytest.mark.parametrize("more", [(), ("--one-pass",)])
@pytest.mark.parametrize("as_folder", [True, False])
def test_of_a_damaged_file_and_its_copy_the_copy_is_taken(tmp_path, as_folder, more):
    path = unclosed(tmp_path / "T3.h5")
    copy = recovered(path)
    result = run(*([tmp_path] if as_folder else [path, copy]), *more)
    assert result.exit_code == 0, result.output
    assert "T3.h5 was not closed in order: its recovered copy T3-recovered.h5 is taken" in result.stderr
    assert "or is still being written" not in result.output
    assert run(copy, *more).stdout == result.stdout


def test_two_copies_are_still_refused(tmp_path):
    path = unclosed(tmp_path / "T3.h5")
    copy = recovered(path)
    (tmp_path / "again.h5").write_bytes(copy.read_bytes())
    result = run(tmp_path)
    assert result.exit_code == 2
    assert "give it once" in result.output


def test_of_trials_of_a_vehicle_too(tmp_path, capsys):
    recovered(unclosed(tmp_path / "T3.h5"))
    with pytest.raises(RecordingError, match=r"T3-recovered\.h5 is a tunnel recording"):
        load_named([tmp_path])
    assert "T3-recovered.h5 is taken" in capsys.readouterr().err


def test_of_a_diagnosis_too(tmp_path, capsys):
    path = unclosed(tmp_path / "T3.h5")
    assert recordings_in([tmp_path]) == [path]
    copy = recovered(path)
    assert recordings_in([tmp_path]) == [copy]
    assert "T3-recovered.h5 is taken" in capsys.readouterr().err
