"""A recording is never overwritten: not by an answer either, whatever option names it."""

from pathlib import Path

import h5py
import pytest

from rig.cli import main
from rig.result_path import RESULT

OPTIONS = {
    "diagnose": ("--json", "--report", "--save-twin", "--plan"),
    "compare": ("--json", "--report", "--save-twin", "--plan"),
    "settle": ("--json", "--report"),
    "prove": ("--json", "--report", "--scores"),
    "fit": ("--json", "--report"),
    "vehicle": ("--json", "--report"),
    "design": ("--json", "-o"),
}


@pytest.mark.parametrize(
    ("command", "option"), [(command, option) for command, options in OPTIONS.items() for option in options]
)
def test_a_recording_is_not_overwritten_by_an_answer(command, option, tmp_path, capsys):
    path = tmp_path / "T1.h5"
    with h5py.File(path, "w") as file:
        file["data"] = [1.0]
    before = path.read_bytes()
    files = {"compare": 2, "prove": 0, "design": 0}.get(command, 1)
    assert main([command, *[str(path)] * files, option, str(path)]) == 2
    said = capsys.readouterr().err
    assert f"{path}: this is an HDF5 file, and a recording is never overwritten; choose another name" in said
    assert said.count("\n") == 1
    assert path.read_bytes() == before


def test_what_is_no_recording_may_be_written_again(tmp_path):
    path = tmp_path / "T1.h5"
    path.write_text("an earlier answer")
    for name in (str(path), str(tmp_path), "-"):
        assert RESULT.convert(name, None, None) == Path(name)
