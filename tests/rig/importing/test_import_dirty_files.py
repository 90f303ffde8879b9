"""Ten and more dirty files, made here, and the sentences of `rig import` about each."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from rig.errors import ConfigError, RecordingError
from rig.hdf5 import load
from rig.importing.command import import_command
from tests.rig.importing import dirty_files as dirty


def said(folder: Path, make) -> str:
    """What the command prints of the file that `make` writes, or the one sentence with which it refuses it."""
    arguments = [str(folder / a) if (folder / a).is_file() else a for a in make(folder)]
    found = CliRunner().invoke(import_command, arguments)
    if found.exit_code == 0:
        return found.output
    assert isinstance(found.exception, ConfigError | RecordingError), found.exception
    assert not list(folder.glob("*.h5*"))
    return str(found.exception)


@pytest.mark.parametrize(
    ("make", "sentences"),
    [
        (dirty.in_units, ["becomes V by (pulse - pulse_stop) / pulse_span", "does not say nominal_voltage"]),
        (
            dirty.in_units_with_supply,
            [
                "understood: time 't (ms)' in ms, 200 rows over 19.9 s, a log (rows 0.1 s apart); ",
                "command 'PWM' (from us: ",
                "0 to 14.4 V",
                "rotation_rate rev/s (from rpm: x 0.0166667)",
                "current A (from mA: x 0.001)",
                "thrust N (from lbf: x 4.44822)",
                "torque N.m (from lbf.in: x 0.112985)",
                "water_temperature degC (from degF: x 0.555556 - 17.7778)",
                "thruster T3 (by the file's name; --thruster NAME for another)",
            ],
        ),
        (dirty.in_an_unknown_unit, ["thrust in 'counts': not a unit that is known for it; known are N, newton, mN"]),
        (
            dirty.level_table,
            ["11 rows 10 s apart, 100 % of them", "[time] levels = true or levels = false", "--levels middle"],
        ),
        (
            dirty.level_table_told,
            ["a table of levels ([time] levels = true): the time is the level's end", "command at a level's start"],
        ),
        (
            dirty.with_tares_between,
            [
                "210 rows, 0 left out",
                "90 rows left out by the filter: phase == 'run'",
                "thrust goes against the command (correlation -0.94)",
                "sign = -1 in the map",
            ],
        ),
        (dirty.two_clocks, ["clocks: drive.csv begins -7.4", "estimated from the command of --with and the thrust"]),
        (dirty.two_clocks_of_a_sine, ["the offset of the two clocks cannot be told", "fit alike", "--offset 12.5"]),
        (dirty.workbook, ["this is an Excel workbook", "Save as > CSV", "soffice --convert-to csv T1_sheet.csv"]),
        (dirty.matlab, ["this is a MATLAB file (version 5 to 7.2)", "writetable"]),
        (dirty.bag, ["this is a ROS 1 bag", "rostopic echo -b T1.bag -p /TOPIC > topic.csv"]),
        (dirty.nobodys, ["whose run is it?", "Give --thruster NAME", 'thruster = "NAME" at the top of the map']),
        (
            dirty.in_another_unit_than_the_map,
            ["the file's header says lbf, the map N: so it was read", 'write unit = "lbf" (or "header")'],
        ),
    ],
    ids=lambda value: value.__name__ if callable(value) else "",
)
def test_what_is_said_of_a_dirty_file(tmp_path, make, sentences):
    text = said(tmp_path, make)
    for sentence in sentences:
        assert sentence in text


def test_units_come_out_in_si(tmp_path):
    said(tmp_path, dirty.in_units_with_supply)
    channels = {channel.quantity: channel for channel in load(tmp_path / "T3_bollard.h5").channels}
    assert channels["command_voltage"].value[-1] == pytest.approx(14.4)
    assert channels["rotation_rate"].value[-1] == pytest.approx(1296 / 60)
    assert channels["current"].value[-1] == pytest.approx(7.2)
    assert channels["thrust"].value[-1] == pytest.approx(0.2 * 14.4**2, abs=1e-3)
    assert channels["torque"].value[0] == pytest.approx(1.5 * 0.1129848290276167)
    assert channels["water_temperature"].value[0] == pytest.approx(20.0)


def test_two_files_lie_on_one_clock(tmp_path):
    """The drive was switched on 7.4 s before the cell: its levels then explain the thrust of each sample."""
    said(tmp_path, dirty.two_clocks)
    recording = load(tmp_path / "T1_cell.h5")
    command, thrust = recording.first_of("command_voltage"), recording.first_of("thrust")
    assert command.time[0] == pytest.approx(0.0)
    assert thrust.time[0] == pytest.approx(7.4, abs=0.15)
    apart = thrust.value - dirty.thrust_of(command.held_at(thrust.time))
    assert float(np.mean(np.abs(apart) < 2.0)) > 0.97
    assert recording.attributes["imported_with"] == "drive.csv"


def test_each_level_of_a_table_with_times_has_its_own_thrust(tmp_path):
    said(tmp_path, dirty.level_table_told)
    recording = load(tmp_path / "T2_levels.h5")
    assert [(s.t_start, s.t_end) for s in recording.steps[:2]] == [(0.0, 10.0), (10.0, 20.0)]
    assert recording.first_of("command_voltage").time.tolist()[:2] == [0.0, 10.0]
    assert recording.first_of("thrust").time[:2].round(9).tolist() == [5.0, 15.0]
