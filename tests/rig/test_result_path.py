"""A recording is never overwritten: not by an answer either, whatever option names it."""

from pathlib import Path

import h5py
import pytest
from click.testing import CliRunner

from rig.blind.command import prove_command
from rig.cli import main
from rig.diagnose.outputs import wanted_of
from rig.errors import ConfigError
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


@pytest.mark.parametrize("words", [("--json", "--report"), ("--scores", "--json"), ("--beside", "--json")])
def test_one_file_for_two_outputs_of_a_proof_is_refused(words, tmp_path):
    path = tmp_path / "a.json"
    path.write_text("hours of work")
    given = [word for option in words for word in (option, str(path))]
    done = CliRunner().invoke(prove_command, ["--no-run", "--store", str(tmp_path / "store"), *given])
    assert done.exit_code == 2
    assert "names the same file; choose another name" in done.output
    assert path.read_text() == "hours of work"


def test_one_file_for_two_outputs_of_a_diagnosis_is_refused(tmp_path):
    for outputs in ({"json_path": "a", "save_twin": "a"}, {"report": "a", "campaign": "./a"}):
        given = {name: tmp_path / value for name, value in outputs.items()}
        nothing = dict.fromkeys(("json_path", "report", "save_twin", "plan", "campaign", "budget"))
        with pytest.raises(ConfigError, match="names the same file"):
            wanted_of(**{**nothing, **given})
