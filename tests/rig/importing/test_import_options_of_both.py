"""--where and --levels are of every file; --with-where and --with-levels of the second alone."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner

from rig.hdf5 import load
from rig.importing.command import import_command

MAP = """about = "t"
[time]
column = "t"
[streams.s.channels.{quantity}]
quantity = "{quantity}"
unit = "{unit}"
column = "x"
"""


@pytest.fixture
def bench(tmp_path):
    """A force and a voltage, a row a second, of which the first and the last five are no run."""
    time = np.arange(30)
    phase = np.where((time >= 5) & (time < 25), "run", "idle")
    for name, value in (("cell", 100 + time), ("drive", time)):
        rows = [f"{t},{x},{p}" for t, x, p in zip(time, value, phase, strict=True)]
        (tmp_path / f"{name}.csv").write_text("\n".join(["t,x,phase", *rows, ""]))
    (tmp_path / "other.csv").write_text("\n".join(["t,x", *(f"{t},{t}" for t in time), ""]))
    (tmp_path / "cell.toml").write_text(MAP.format(quantity="thrust", unit="N"))
    (tmp_path / "drive.toml").write_text(MAP.format(quantity="command_voltage", unit="V"))
    return tmp_path


def imported(folder, *options, second="drive.csv"):
    out = folder / "out.h5"
    out.unlink(missing_ok=True)
    told = CliRunner().invoke(
        import_command,
        [
            *(str(folder / "cell.csv"), "--map", str(folder / "cell.toml"), "-o", str(out), "--thruster", "T1"),
            *("--with", str(folder / second), "--with-map", str(folder / "drive.toml"), "--offset", "0", *options),
        ],
    )
    if told.exception is not None:
        return str(told.exception)
    recording = load(out)
    return [recording.first_of(quantity) for quantity in ("thrust", "command_voltage")]


def test_a_filter_is_of_both_files(bench):
    force, volts = imported(bench, "--where", "phase == 'run'", "--levels", "no")
    assert force.value.tolist() == list(range(105, 125))
    assert volts.value.tolist() == list(range(5, 25))


def test_the_second_file_may_have_a_filter_of_its_own(bench):
    where = ("--where", "phase == 'run'", "--levels", "no")
    _, volts = imported(bench, *where, "--with-where", "x < 3")
    assert volts.value.tolist() == [0, 1, 2]
    _, every = imported(bench, *where, "--with-where", "", second="other.csv")
    assert every.value.size == 30


def test_a_filter_that_the_second_file_cannot_be_asked_is_refused_with_its_name(bench):
    told = imported(bench, "--where", "phase == 'run'", "--levels", "no", second="other.csv")
    assert told.startswith("other.csv: ")
    assert "phase" in told


def test_what_rows_are_is_of_both_files(bench):
    """The command of a level begins with it; the force measured in a level is in its middle."""
    force, volts = imported(bench, "--levels", "start")
    assert force.time[0] == pytest.approx(0.5)
    assert volts.time[0] == pytest.approx(0.0)
    of_a_log, levels = imported(bench, "--levels", "no", "--with-levels", "middle")
    assert np.diff(of_a_log.time) == pytest.approx(1.0)
    assert levels.time[0] == pytest.approx(0.0), "its first level began half a level before its time"
    assert any("levels" in event.text for event in load(bench / "out.h5").events)


def test_options_of_a_map_are_refused_without_one(bench):
    (bench / "plain.json").write_text("{}")
    told = CliRunner().invoke(import_command, [str(bench / "plain.json"), "--with-where", "x > 1"])
    assert "--with-where is for a map" in str(told.exception)
