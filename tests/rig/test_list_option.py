"""`--holdout a b c`: every file up to the next option is held out, none of them fitted."""

from __future__ import annotations

from pathlib import Path

import click
import pytest
from click.testing import CliRunner

import rig.diagnose.command as diagnose_module
import rig.vehicle.command as vehicle_module
from rig.cli import rig
from rig.errors import RecordingError
from rig.list_option import ListCommand, ListOption

ASKED = {
    "one value": (["a.h5", "--holdout", "b.h5"], ["a.h5"], ["b.h5"]),
    "every file after it": (["a.h5", "--holdout", "b.h5", "c.h5"], ["a.h5"], ["b.h5", "c.h5"]),
    "up to the next option": (["--holdout", "b.h5", "c.h5", "--json", "-", "a.h5"], ["a.h5"], ["b.h5", "c.h5"]),
    "up to --": (["--holdout", "b.h5", "--", "a.h5", "c.h5"], ["a.h5", "c.h5"], ["b.h5"]),
    "repeated": (["a.h5", "--holdout", "b.h5", "--holdout", "c.h5"], ["a.h5"], ["b.h5", "c.h5"]),
    "both": (["a.h5", "--holdout", "b.h5", "c.h5", "--holdout=d.h5"], ["a.h5"], ["b.h5", "c.h5", "d.h5"]),
    "with =": (["a.h5", "--holdout=b.h5", "c.h5"], ["a.h5"], ["b.h5", "c.h5"]),
}


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> dict[str, list[str]]:
    """What each command would fit and hold out; nothing is read."""
    got: dict[str, list[str]] = {}

    def taken(files, held):
        got.update(fitted=[Path(f).name for f in files], held=[Path(f).name for f in held])
        raise RecordingError("enough")

    monkeypatch.setattr(diagnose_module, "diagnose_files", lambda files, held, *_, **__: taken(files, held))
    monkeypatch.setattr(vehicle_module, "identify_files", lambda files, _, __, held, ___: taken(files, held))
    return got


@pytest.mark.parametrize("command", ["diagnose", "vehicle"])
@pytest.mark.parametrize("name", ASKED)
def test_what_is_held_out_is_not_fitted(name, command, asked):
    arguments, fitted, held = ASKED[name]
    said = CliRunner().invoke(rig, [command, *arguments])
    assert said.output.strip() == f"rig {command}: enough"
    assert asked == {"fitted": fitted, "held": held}


@pytest.mark.parametrize("arguments", [["a.h5", "--holdout"], ["a.h5", "--holdout", "--json", "-"]])
def test_a_list_without_a_file_is_refused(arguments):
    said = CliRunner().invoke(rig, ["diagnose", *arguments])
    assert said.exit_code == 2
    assert "--holdout needs a value" in said.output


def test_the_help_says_how_far_the_list_goes():
    for command in ("diagnose", "vehicle"):
        words = " ".join(CliRunner().invoke(rig, [command, "--help"]).output.split())
        assert "--holdout FILE..." in words
        assert "every file up to the next option" in words


def test_an_option_that_is_no_list_takes_one_value():
    @click.command(cls=ListCommand)
    @click.argument("files", nargs=-1)
    @click.option("--some", cls=ListOption, multiple=True)
    @click.option("--one", multiple=True)
    def command(files, some, one):
        click.echo(f"{files} {some} {one}")

    said = CliRunner().invoke(command, ["a", "--one", "b", "c", "--some", "d", "-"])
    assert said.output.strip() == "('a', 'c') ('d', '-') ('b',)"


def test_no_file_is_both_fitted_and_held_out(tmp_path):
    (tmp_path / "a.h5").write_text("not even a recording")
    (tmp_path / "b.h5").write_text("not even a recording")
    for arguments in (["a.h5", "--holdout", "b.h5", "a.h5"], [".", "--holdout", "b.h5"]):
        said = CliRunner().invoke(rig, ["diagnose", *(str(tmp_path / a) if a[0] != "-" else a for a in arguments)])
        assert said.exit_code == 2
        assert "is both to be diagnosed and held out" in said.output
        assert said.output.count("\n") == 1
