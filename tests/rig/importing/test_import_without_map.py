"""A table without a map: what to type, and nothing written."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from rig.errors import RecordingError
from rig.importing.command import import_command

RCBENCHMARK = "Time (s),ESC signal (µs),Thrust (kgf),Torque (N·m)\n0.0,1000,0.01,0.0\n0.02,1100,0.2,0.01\n"


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("run.csv", RCBENCHMARK.encode(), "the columns are those of rcbenchmark: --map rcbenchmark"),
        ("own.csv", "# Prüfstand 3\nZeit;Schub (kgf)\n0,0;1,2\n".encode("latin-1"), "fits '# Prüfstand 3'"),
        (
            "plain.txt",
            b"\n0.0 1.0 2.0\n0.1 1.0 2.0\n",
            "fits '0.0 1.0 2.0': say what its columns are in one of your own",
        ),
    ],
)
def test_a_table_without_a_map_says_what_to_type(tmp_path, name, content, said):
    file = tmp_path / name
    file.write_bytes(content)
    told = CliRunner().invoke(import_command, [str(file)])
    assert isinstance(told.exception, RecordingError)
    assert str(told.exception).startswith(f"{name}: no JSON, and a table needs --map: ")
    assert said in str(told.exception)
    assert list(tmp_path.iterdir()) == [file]


def test_json_that_is_broken_is_told_as_json(tmp_path):
    file = tmp_path / "run.json"
    file.write_text('\n {"format": ')
    told = CliRunner().invoke(import_command, [str(file)])
    assert "not JSON" in str(told.exception)
