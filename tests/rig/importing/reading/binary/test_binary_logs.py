"""Logs that are no text: the same channels, rates and units from each, through the same maps; one sentence for what
can't be read."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import nptdms
import numpy as np
import pytest

from rig.cli import main
from rig.errors import RecordingError
from rig.hdf5 import load
from rig.importing.reading.binary import kinds
from rig.importing.reading.binary.kinds import KINDS, read_binary
from rig.importing.reading.table import Table
from tests.rig.importing.reading.binary import logs

MAP = """
about = "a log"
[file]
kind = "{kind}"
message = {message}
[time]
column = "{time}"
unit = "{unit}"
levels = false
[streams.drive.channels.command_voltage]
quantity = "command_voltage"
unit = "V"
{volts}
[streams.cell.channels.thrust]
quantity = "thrust"
unit = "N"
{force}
"""


def read(folder: Path, data: bytes, name: str, wanted: Sequence[str]) -> Table:
    path = folder / "a.log"
    path.write_bytes(data)
    return read_binary(path, name, wanted)


def made(name: str, folder: Path) -> bytes:
    make = getattr(logs, name)
    return make(folder) if name in ("bag", "mcap_ros2") else make()


COLUMN = ('column = "volts"', 'column = "force"')
DATA = ('column = "/drive.data"', 'column = "/cell.data"')
TOPICS = ["/drive", "/cell"]
CASES = [
    ("parquet", "parquet", [], "t", *COLUMN),
    ("mat", "mat", ["run"], "t", *COLUMN),
    ("mat_7_3", "mat", ["run"], "t", *COLUMN),
    ("tdms", "tdms", ["run"], "time", *COLUMN),
    ("mdf", "mdf", ["run"], "time", *COLUMN),
    ("mcap", "mcap", TOPICS, "time", 'column = "/drive.volts"', 'column = "/cell.wrench.force[1]"'),
    ("mcap_ros2", "mcap", TOPICS, "time", *DATA),
    ("bag", "bag", TOPICS, "time", *DATA),
    (
        *("ulog", "ulog", ["actuator_motors", "cell"], "time"),
        *('column = "actuator_motors.control[0]"\nfactor = 16', 'column = "cell.force"'),
    ),
    (
        *("dataflash", "dataflash", ["RCOU", "CELL"], "time"),
        *('column = "RCOU.C1"\nfactor = 0.04\noffset = -60', 'column = "CELL.F"'),
    ),
]


@pytest.mark.parametrize(("name", "kind", "message", "time", "volts", "force"), CASES, ids=[case[0] for case in CASES])
def test_channels_rates_and_units(tmp_path, name, kind, message, time, volts, force):
    (tmp_path / "T1.log").write_bytes(made(name, tmp_path))
    text = MAP.format(kind=kind, message=repr(message).replace("'", '"'), time=time, unit="s", volts=volts, force=force)
    (tmp_path / "map.toml").write_text(text)
    assert main(["import", str(tmp_path / "T1.log"), "--map", str(tmp_path / "map.toml")]) == 0
    recording = load(tmp_path / "T1.h5")
    drive, cell = recording.first_of("command_voltage"), recording.first_of("thrust")
    assert drive.value == pytest.approx(logs.VOLTS, abs=1e-6)
    assert cell.value == pytest.approx(logs.THRUST, abs=1e-6)
    assert np.diff(cell.time) == pytest.approx(np.full(199, 0.1), abs=1e-6)
    late = 0.02 if name in ("mcap", "ulog", "dataflash") else 0.0
    assert cell.time[0] - drive.time[0] == pytest.approx(late, abs=1e-6)
    assert (drive.unit, cell.unit) == ("V", "N")


def test_where_no_message_is_named_all_are_there_and_each_stream_has_its_own_rows(tmp_path):
    (tmp_path / "T1.BIN").write_bytes(logs.dataflash())
    volts, force = 'column = "RCOU.C1"\nfactor = 0.04\noffset = -60', 'column = "CELL.F"'
    text = MAP.format(kind="dataflash", message="[]", time="time", unit="s", volts=volts, force=force)
    text = text.replace("[streams.drive.ch", "[streams.drive]\nchanges = true\n[streams.drive.ch")
    (tmp_path / "map.toml").write_text(text)
    assert main(["import", str(tmp_path / "T1.BIN"), "--map", str(tmp_path / "map.toml")]) == 0
    command = load(tmp_path / "T1.h5").first_of("command_voltage")
    assert command.value == pytest.approx(logs.VOLTS[np.append(True, np.diff(logs.VOLTS) != 0)])


def test_telemetry_of_a_vehicle(tmp_path):
    table = read(tmp_path, logs.tlog(), "tlog", ["SERVO_OUTPUT_RAW", "SCALED_PRESSURE2"])
    rows = [cells for _, cells in table.rows]
    pulse, pressure = (table.names.index(n) for n in ("SERVO_OUTPUT_RAW.servo1_raw", "SCALED_PRESSURE2.press_abs"))
    assert len(rows) == 2 * logs.TIME.size
    assert [float(row[pulse]) for row in rows if row[pulse]] == [round(1500 + 25 * v) for v in logs.VOLTS]
    assert float(rows[1][pressure]) == pytest.approx(1013.0)
    assert float(rows[0][0]) == pytest.approx(logs.EPOCH)


@pytest.mark.parametrize("name", ["raw1.tdms", "big_endian.tdms"])
def test_files_that_others_wrote(tmp_path, name):
    """LabVIEW's, of the tests that npTDMS ships: what its own reader says of them."""
    data = (Path(nptdms.__file__).parent / "test" / "data" / name).read_bytes()
    (group, *_) = [g for g in nptdms.TdmsFile.read(BytesIO(data)).groups() if g.channels()]
    table = read(tmp_path, data, "tdms", [group.name])
    column = [float(cells[table.names.index(group.channels()[0].name)]) for _, cells in table.rows]
    assert column == pytest.approx(group.channels()[0][:])


@pytest.mark.parametrize("name", ["parquet", "mat", "tdms", "mdf", "mcap", "ulog", "dataflash", "bag"])
def test_an_empty_and_a_foreign_file_get_one_sentence(tmp_path, name):
    with pytest.raises(RecordingError, match="is empty"):
        read(tmp_path, b"", name, [])
    foreign = logs.mat() if name == "parquet" else logs.parquet()
    with pytest.raises(RecordingError, match=f'says \\[file\\] kind = "{name}", but this is no {KINDS[name].what[:6]}'):
        read(tmp_path, foreign, name, [])


@pytest.mark.parametrize("name", ["parquet", "mat", "mdf", "mcap", "bag"])
def test_a_truncated_file_gets_one_sentence(tmp_path, name):
    data = made(name, tmp_path)
    with pytest.raises(RecordingError, match="cut off") as told:
        read(tmp_path, data[: len(data) // 3], name, [])
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("name", ["ulog", "dataflash", "tdms", "tlog"])
def test_of_a_log_that_was_cut_off_what_is_whole_is_read(tmp_path, name):
    data = made(name, Path())
    wanted = ["run"] if name == "tdms" else []
    cut = len(read(tmp_path, data[: len(data) // 3], name, wanted).rows)
    assert 0.1 < cut / len(read(tmp_path, data, name, wanted).rows) < 0.5


def test_what_is_not_in_the_file_is_told_with_what_is(tmp_path):
    with pytest.raises(RecordingError, match="has no 'BAT'; it has RCOU"):
        read(tmp_path, logs.dataflash(), "dataflash", ["RCOU", "BAT"])
    with pytest.raises(RecordingError, match="has no '/x'"):
        read(tmp_path, logs.mcap(), "mcap", ["/x"])


def test_a_missing_library_names_its_extra(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(kinds, "find_spec", lambda name: None)
    (tmp_path / "a.ulg").write_bytes(logs.ulog())
    text = MAP.format(kind="ulog", message="[]", time="time", unit="s", volts='column = "x"', force='column = "y"')
    (tmp_path / "m.toml").write_text(text)
    assert main(["import", str(tmp_path / "a.ulg"), "--map", str(tmp_path / "m.toml"), "--thruster", "T1"]) == 2
    assert "pip install 'thruster-rig[ulog]'" in capsys.readouterr().err


def test_no_library_is_loaded_for_text(tmp_path):
    (tmp_path / "T1.csv").write_text("t,v,f\n" + "".join(f"{i / 10},{i % 7},{i % 5}\n" for i in range(50)))
    text = MAP.format(kind="text", message="[]", time="t", unit="s", volts='column = "v"', force='column = "f"')
    (tmp_path / "m.toml").write_text(text)
    code = (
        "import sys; from rig.cli import main; assert main(sys.argv[1:]) == 0;"
        "assert not {'pyulog', 'pymavlink', 'rosbags', 'nptdms', 'asammdf', 'pyarrow', 'mcap'} & set(sys.modules)"
    )
    arguments = ["import", str(tmp_path / "T1.csv"), "--map", str(tmp_path / "m.toml")]
    subprocess.run([sys.executable, "-c", code, *arguments], check=True, capture_output=True)


def test_logs_of_a_bluerov2_by_the_shipped_maps(tmp_path):
    (tmp_path / "dive.BIN").write_bytes(logs.dive())
    assert main(["import", str(tmp_path / "dive.BIN"), "--map", "bluerov2_dataflash", "--set", "reverse_6=-1"]) == 0
    recording = load(tmp_path / "dive.h5")
    command, depth = recording.first_of("command_voltage"), recording.first_of("depth")
    driven = logs.VOLTS[np.append(True, np.diff(logs.VOLTS) != 0)] / 16.0
    assert command.value == pytest.approx(driven)
    assert depth.value == pytest.approx(0.05 * logs.TIME, abs=1e-6)
    (tmp_path / "dive.tlog").write_bytes(logs.tlog())
    out = tmp_path / "telemetry.h5"
    assert main(["import", str(tmp_path / "dive.tlog"), "--map", "bluerov2_tlog", "-o", str(out)]) == 0
    risen = load(out).first_of("depth").value
    assert risen[-1] - risen[0] == pytest.approx(logs.TIME[-1] * 100 / (998.0 * 9.80665), rel=1e-4)


def test_a_log_of_px4_and_one_of_vrx_by_the_shipped_maps(tmp_path):
    (tmp_path / "sea.ulg").write_bytes(logs.ulog(second="vehicle_local_position"))
    assert main(["import", str(tmp_path / "sea.ulg"), "--map", "px4_ulog"]) == 0
    speed = load(tmp_path / "sea.h5").first_of("speed").value
    assert speed == pytest.approx(np.abs(logs.THRUST), rel=1e-6)
    (tmp_path / "boat.mcap").write_bytes(logs.vrx())
    assert main(["import", str(tmp_path / "boat.mcap"), "--map", "vrx_mcap"]) == 0
    boat = load(tmp_path / "boat.h5")
    assert [c.thruster for c in boat.channels if c.quantity == "command_voltage"] == ["port", "starboard"]
    assert boat.first_of("speed").value == pytest.approx(0.1 * logs.TIME)
