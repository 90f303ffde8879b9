"""Import: every layout of the shipped maps in small, and every kind of dirt in a file."""

import numpy as np
import pytest
from click.testing import CliRunner

from rig.errors import ConfigError, RecordingError
from rig.hdf5 import load
from rig.importing.command import import_command, import_file
from rig.importing.mapping import build_map, read_map, shipped

PLAIN = {
    "about": "t",
    "time": {"column": "t"},
    "streams": {"s": {"channels": {"thrust": {"quantity": "thrust", "unit": "N", "column": "f"}}}},
}


def imported(tmp_path, text, plan, **overrides):
    source = tmp_path / "in.csv"
    source.write_bytes(text if isinstance(text, bytes) else text.encode())
    out = tmp_path / "out.h5"
    out.unlink(missing_ok=True)
    plan = read_map(plan) if isinstance(plan, str) else build_map(plan, "", "test")
    summary = import_file(source, plan, out, overrides)
    recording = load(out)
    assert recording.complete
    assert [event.text for event in recording.events] == list(summary.sentences)
    return summary, recording, {channel.name: channel for channel in recording.channels}


def plan(**changes):
    return {**PLAIN, **changes}


def values(channel):
    return channel.value.round(6).tolist()


def test_levels_without_header_become_holds(tmp_path):
    text = "-5,-4.8,-2305,-5,-55.2,0.9,-2296\n0,0,0,0,0,0,0\n5,5,2425.9,5,50.8,-1.7,2366\n"
    _, recording, found = imported(tmp_path, text, "tank_static_levels")
    assert values(found["command_voltage"]) == [-5, 0, 5]
    assert found["command_voltage"].time.tolist() == [0, 4, 8]
    assert found["thrust"].time.tolist() == [2, 6, 10]
    assert values(found["rotation_rate"]) == [round(-2305 / 60, 6), 0, round(2425.9 / 60, 6)]
    assert [(s.phase, s.command_voltage, s.t_start, s.t_end) for s in recording.steps] == [
        ("hold", -5, 0, 4),
        ("hold", 0, 4, 8),
        ("hold", 5, 8, 12),
    ]
    assert (recording.kind, recording.thruster) == ("bollard", "ROV thruster D=0.1151 m")


def six_axis(t, force, tach):
    return ",".join(map(str, [0, t, *[2.5] * 6, *[0.1] * 6, 0, force, 0, 0, 0.05, 0, tach]))


def test_six_axis_cell(tmp_path):
    text = "\n".join(six_axis(0.001 * k, -2.0 * k, 0.5 * k) for k in range(4))
    _, _, found = imported(tmp_path, text, "tank_six_axis")
    assert values(found["thrust"]) == [0, 2, 4, 6]
    assert found["thrust"].time[-1] == pytest.approx(0.003)
    assert found["rotation_rate"].value[2] == pytest.approx(49.9723 / (2 * np.pi))
    _, _, found = imported(tmp_path, text, "tank_two_state", direction=-1)
    assert found["rotation_rate"].value[2] == pytest.approx(-49.9723 / (2 * np.pi))


def test_vectrino(tmp_path):
    row = "  {:7.3f}  6 00100011  {}  -0.002  -0.0020  -0.0031  31 51 52 51  1.9 6.9 6.7 4.9  60 77 86 57\r\n"
    _, _, found = imported(tmp_path, row.format(0.2, 0.25) + row.format(0.24, -0.5), "nortek_vectrino")
    assert values(found["flow_speed"]) == [0.25, -0.5]
    assert found["flow_speed"].time.tolist() == pytest.approx([0, 0.04])
    assert values(found["correlation_x"]) == [60, 60]


SINE = """#Channel\tAI_CH0\tAI_CH1\tAI_CH2\tAI_CH3
#Sensor \tForce\tCurrent\tN/C\tVoltage\tLever_Arm_Ratio
#Scaling_Factor\t885.74\t4.878\t1.0\t23.533\t0.667
#Sample_Rate\tEvery 0.05s
29-Jun-2022 10:36:57.239\t<begin logging>
29-Jun-2022 10:36:57.265\t0.0\t0.0\t0.0\t0.0
29-Jun-2022 10:36:57.465\t0.02\t-0.01\t0.0\t1.0
29-Jun-2022 10:36:57.965\t0.03\t0.5\t0.0\t-2.0
29-Jun-2022 10:41:28.807\t<end logging>
"""


def test_scaling_factors_come_from_the_header(tmp_path):
    summary, recording, found = imported(tmp_path, SINE, "labview_voltage_sine")
    assert found["thrust"].value.tolist() == pytest.approx(np.array([0.02, 0.03]) * 885.74 * 0.667 * 4.4482216152605)
    assert found["motor_voltage"].value.tolist() == pytest.approx([23.533, -47.066])
    assert found["thrust"].time.tolist() == pytest.approx([0.2, 0.7])
    said = " ".join(summary.sentences)
    assert "force_scale = 885.74" in said
    assert "2022-06-29T10:36:57.265000, without a time zone" in said
    assert "force: the first 1 rows are exactly 0" in said
    assert recording.first_of("command_voltage") is None
    with pytest.raises(RecordingError, match="no line above the data starts with '#Scaling_Factor'"):
        imported(tmp_path, SINE.replace("#Scaling_Factor", "#Scale"), "labview_voltage_sine")
    with pytest.raises(RecordingError, match="field 2 of #Scaling_Factor is 'much'"):
        imported(tmp_path, SINE.replace("885.74", "much"), "labview_voltage_sine")


def test_a_rate_stands_for_a_time(tmp_path):
    text = "weight[g],pwm,vbat[V],rpm1,rpm2,rpm3,rpm4,v[V],i[A],p[W]\n" + "".join(
        f"{w},{p},3.9,60,60,120,0,3.8,0.2,0.7\n" for w, p in ((0, 0), (1, 65535), (100, 65535), (50, 0))
    )
    _, _, found = imported(tmp_path, text, "crazyflie_supply_sag")
    assert values(found["command_voltage"]) == [0, 4.2, 0]
    assert found["command_voltage"].time.tolist() == pytest.approx([0, 0.01, 0.03])
    assert values(found["thrust"]) == [0, 0.009807, 0.980665, 0.490332]
    assert values(found["rotation_rate"])[0] == 1


def test_effort_is_volts_only_if_somebody_says_so(tmp_path):
    text = "effort,thrust_N\n-1,-85.1\n0.5,20\n"
    summary, _, found = imported(tmp_path, text, "effort_static")
    assert values(found["command_voltage"]) == [-1, 0.5]
    assert any("1 V stands for full effort" in sentence for sentence in summary.sentences)
    _, _, found = imported(tmp_path, text, "effort_static", nominal_voltage=48)
    assert values(found["command_voltage"]) == [-48, 24]
    with pytest.raises(ConfigError, match="did you mean nominal_voltage"):
        imported(tmp_path, text, "effort_static", nominal_volts=48)


def test_unsigned_speed_takes_the_sign_of_the_command(tmp_path):
    text = "PWM (\u03bcs),RPM,Current (A),Voltage (V),Power (W),Force (Kg f),Force (N),Efficiency (g/W)\n"
    text += "1100,3600,28,18,508,-4.6,-45.0,9\n1500,0,0,18,0,0,0,0\n1900,3600,28,18,508,6,59.0,9\n"
    _, _, found = imported(tmp_path, text, "blue_robotics_static")
    assert values(found["command_voltage"]) == [-18, 0, 18]
    assert values(found["rotation_rate"]) == [-60, 0, 60]
    assert values(found["thrust"]) == [-45, 0, 59]


def test_vehicle_trials(tmp_path):
    text = (
        "t_s,rel_alt_m,throttle_pwm_us,roll_rad,pitch_rad\n5,-1.2,1500,0,0\n5.34,-1.1,1580,0.1,0\n5.7,-1.0,1580,0,0\n"
    )
    _, recording, found = imported(tmp_path, text, "rov_depth")
    assert recording.kind == "vehicle"
    assert values(found["depth"]) == [1.2, 1.1, 1.0]
    assert found["depth"].axis == "heave"
    assert values(found["command_voltage"]) == [0, 0.2]
    assert found["depth"].time.tolist() == pytest.approx([0, 0.34, 0.7])
    text = (
        "t_s,speed_m_s,port_cmd,stbd_cmd,heading_deg,surge_cmd\n0,0.2,0.3,-0.2,179,0.25\n0.1,0.2,0.3,-0.2,-179,0.25\n"
    )
    _, _, found = imported(tmp_path, text, "usv_lake")
    assert found["heading"].value.tolist() == pytest.approx(np.radians([179, 181]))
    assert (found["command_port"].thruster, found["command_starboard"].thruster) == ("port", "starboard")
    assert found["command_port"].value.size == 1
    _, recording, found = imported(tmp_path, "Thrust Command,Mean Force [N]\n1.0,20.3\n-1.0,-6.1\n", "usv_bollard")
    assert values(found["thrust"]) == [20.3, -6.1]


RCB = "\ufeffTime (s),ESC signal (µs),Servo 1 (µs),Torque (N·m),Thrust ({}),Voltage (V),Current (A)," + (
    "Motor Electrical Speed (RPM),App message,\n"
)


@pytest.mark.parametrize(("unit", "newton"), [("N", 1.0), ("gf", 0.00980665), ("kgf", 9.80665)])
def test_rcbenchmark_in_any_unit_and_with_empty_cells(tmp_path, unit, newton):
    text = RCB.format(unit) + "0.1,1000,,0,0,12.1,0.1,0,start,\n0.2,1500,,0.02,2,12,3,6000,,\n0.3,1500,,,2,12,3,6000,\n"
    summary, _, found = imported(tmp_path, text, "rcbenchmark", nominal_voltage=12)
    assert found["thrust"].value.tolist() == pytest.approx([0, 2 * newton, 2 * newton])
    assert values(found["command_voltage"]) == [0, 6]
    assert values(found["rotation_rate"]) == [0, 100, 100]
    assert np.isnan(found["torque"].value[2])
    assert "rotation_rate_optical" not in found
    assert any("no column for optical_rpm" in sentence for sentence in summary.sentences)
    assert summary.bad == 0


def test_bad_rows_are_counted_by_reason_with_line_numbers(tmp_path):
    text = "t,f\n0,1\n1\n2,x\n3,nan\n4,2\n3.5,3\n5,inf\nsoon,1\n6,4,4\n7,5\n8,6\n9,7\n10,8\n11,9\n12,10\n"
    summary, recording, found = imported(tmp_path, text, PLAIN)
    assert values(found["thrust"]) == [1, 2, 5, 6, 7, 8, 9, 10]
    assert (summary.rows, summary.bad) == (8, 7)
    assert set(summary.sentences) == {
        "1 rows left out: fewer than 2 columns (lines 3)",
        "1 rows left out: more than 2 columns (lines 10)",
        "2 rows left out: a cell is not a number (lines 4, 5)",
        "1 rows left out: time runs backwards (lines 7)",
        "1 rows left out: a cell is not a finite number (lines 8)",
        "1 rows left out: the time is not as the map says (lines 9)",
    }
    assert {event.level for event in recording.events} == {"warning"}


def test_a_file_that_is_mostly_bad_is_refused_and_leaves_nothing(tmp_path):
    with pytest.raises(RecordingError, match=r"in.csv: 7 of 8 rows are bad.*lines 3, 4, 5, 6, 7, \.\.\."):
        imported(tmp_path, "t,f\n0,1\n" + "1,x\n" * 7, PLAIN)
    with pytest.raises(RecordingError, match="no row of data"):
        imported(tmp_path, "t,f\n", PLAIN)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.csv"]


def test_a_recording_is_not_overwritten_and_a_missing_file_is_named(tmp_path):
    imported(tmp_path, "t,f\n0,1\n", PLAIN)
    with pytest.raises(RecordingError, match="never overwritten"):
        import_file(tmp_path / "in.csv", build_map(PLAIN, "", "test"), tmp_path / "out.h5")
    with pytest.raises(RecordingError, match="can't be read"):
        import_file(tmp_path / "no.csv", build_map(PLAIN, "", "test"), tmp_path / "new.h5")


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ({}, b"\xef\xbb\xbft,f\r\n0,1\r\n1,2\r\n"),
        ({"encoding": "utf-16"}, "t,f\n0,1\n1,2\n".encode("utf-16")),
        ({"delimiter": ";", "decimal": ","}, "t;f\n0,0;1,0\n1,0;2,0\n"),
        ({"delimiter": "tab"}, "t\tf\n0\t1\n1\t2\n"),
        ({"delimiter": "whitespace"}, "  t   f\n 0  1\n 1  2\n"),
        ({"comment": "%"}, "% made today\n% by hand\nt,f\n0,1\n1,2\n"),
        ({"skip_rows": 2}, "made today\nby,hand\nt,f\n0,1\n1,2\n"),
        ({}, 't,f,"a, note"\n0,1,"x, y"\n1,2,"z"\n'),
        ({}, "f,t\n1,5\n\n2,6\n"),
        ({}, "t,f,\n0,1\n1,2,\n"),
    ],
)
def test_separators_encodings_and_what_stands_above(tmp_path, file, text):
    _, _, found = imported(tmp_path, text, plan(file=file))
    assert values(found["thrust"]) == [1, 2]
    assert found["thrust"].time.tolist() == [0, 1]


def test_bytes_that_are_not_utf8_are_read_as_latin1_and_that_is_said(tmp_path):
    summary, _, found = imported(tmp_path, "t,f,°\n0,1,2\n".encode("latin-1"), PLAIN)
    assert values(found["thrust"]) == [1]
    assert "the file is not utf-8; read as latin-1" in summary.sentences
    with pytest.raises(RecordingError, match="no encoding is called 'utf-9'"):
        imported(tmp_path, "t,f\n0,1\n", plan(file={"encoding": "utf-9"}))


@pytest.mark.parametrize(
    ("clock", "cells", "seconds", "created"),
    [
        ({"unit": "ms"}, ("10", "1510"), 1.5, ""),
        ({"unit": "min"}, ("0", "2"), 120, ""),
        ({"format": "iso"}, ("2024-03-01T10:00:00+02:00", "2024-03-01T08:00:01.5Z"), 1.5, "2024-03-01T08:00:00+00:00"),
        ({"format": "iso"}, ("2024-03-01 10:00:00", "2024-03-01 10:00:03"), 3, ""),
        ({"format": "%H:%M:%S %z"}, ("10:00:00 +0100", "10:00:02 +0100"), 2, "1900-01-01T09:00:00+00:00"),
        ({"format": "%d.%m.%Y %H:%M"}, ("1.3.2024 10:00", "1.3.2024 10:01"), 60, ""),
    ],
)
def test_times(tmp_path, clock, cells, seconds, created):
    text = f"t,f\n{cells[0]},1\n{cells[1]},2\n"
    _, recording, found = imported(tmp_path, text, plan(time={"column": 1, **clock}))
    assert found["thrust"].time.tolist() == pytest.approx([0, seconds])
    assert recording.created == created


def test_channels_with_factor_offset_sign_and_streams_with_clocks_of_their_own(tmp_path):
    facts = {"column": 2, "factor": 2.0, "offset": 1.0, "sign": -1, "unit": "1", "integer": True, "noise_std": 0.5}
    facts |= {"calibration": {"role": "primary"}}
    streams = {
        "a": {"channels": {"x": facts}, "source": "cell", "device_id": "7", "note": "n"},
        "b": {"channels": {"y": {"value": "c4 - x0", "unit": "1"}}, "time": {"column": "t2", "unit": "ms"}},
    }
    changed = plan(streams=streams, parameters={"x0": 1.0})
    _, recording, found = imported(tmp_path, "t,f,t2,y\n10,1,10500,3\n11,2,11600,4\n", changed)
    assert values(found["x"]) == [-3, -5]
    assert found["y"].time.tolist() == pytest.approx([0.5, 1.6])
    assert values(found["y"]) == [2, 3]
    assert found["x"].calibration["role"] == "primary"
    assert "column 2" in str(found["x"].calibration["imported_as"])
    assert recording.attributes["streams"]["a"] == {"source": "cell", "device_id": "7", "note": "n"}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"tiem": {}}, "unknown key tiem; did you mean time"),
        ({"file": {"headr": True}}, "test: file: unknown key headr; did you mean header"),
        ({"file": {"delimiter": "::"}}, "one character"),
        ({"file": 3}, "file must be a table"),
        ({"streams": 3}, "streams must be tables"),
        ({"time": {"column": 1, "rate": 5.0}}, "exactly one of column, rate, level_duration"),
        ({"time": {"column": 1, "unit": "h"}}, "time.unit"),
        ({"columns": {"a": {"any": []}}}, "columns.a: unknown key any; did you mean any_of"),
    ],
)
def test_maps_that_are_wrong_name_the_key(change, says):
    with pytest.raises(ConfigError, match=says):
        build_map(plan(**change), "", "test")


@pytest.mark.parametrize(
    ("channel", "says"),
    [
        ({"quantity": "thrust", "unit": "kN", "column": 1}, "thrust must be in N, got 'kN'"),
        ({"quantity": "force", "unit": "N", "column": 1}, "force is no quantity"),
        ({"unit": "N"}, "either column or value"),
        ({"unit": "N", "value": "__import__('os')"}, "not allowed"),
        ({"unit": "N", "collumn": 1}, "did you mean column"),
    ],
)
def test_channels_that_are_wrong_are_refused(channel, says):
    with pytest.raises(ConfigError, match=says):
        build_map(plan(streams={"s": {"channels": {"x": channel}}}), "", "test")


@pytest.mark.parametrize(
    ("channel", "time", "says"),
    [
        ({"unit": "N", "column": "Forse"}, {"column": "t"}, "no column is called 'Forse'; the nearest is 'Force'"),
        ({"unit": "N", "column": 9}, {"column": "t"}, "column 9 is not there: rows have 2 columns"),
        ({"unit": "N", "column": 2}, {"column": "clock"}, "no column is called 'clock'"),
    ],
)
def test_columns_that_are_not_there_are_named(tmp_path, channel, time, says):
    changed = plan(streams={"s": {"channels": {"x": channel}}}, time=time)
    with pytest.raises(RecordingError, match=says):
        imported(tmp_path, "t,Force\n0,1\n", changed)


def test_a_map_none_of_whose_channels_is_there_is_refused(tmp_path):
    columns = {"a": {"any_of": [["nowhere", 1.0]], "optional": True}}
    streams = {"s": {"channels": {"x": {"unit": "1", "value": "a"}}}}
    with pytest.raises(RecordingError, match="none of the map's channels"):
        imported(tmp_path, "t,f\n0,1\n", plan(columns=columns, streams=streams))


def test_every_shipped_map_is_sound_and_says_what_it_is():
    assert len(shipped()) >= 12
    for name in shipped():
        assert len(read_map(name).about) > 20
    with pytest.raises(ConfigError, match="did you mean rov_depth"):
        read_map("rov_depht")
    with pytest.raises(ConfigError, match="--list"):
        read_map("/nowhere/zzz")


def test_a_map_that_is_not_toml_is_named(tmp_path):
    (tmp_path / "m.toml").write_text("about = \n")
    with pytest.raises(ConfigError, match=r"m\.toml: Invalid value"):
        read_map(str(tmp_path / "m.toml"))


def test_the_same_import_has_the_same_id_and_another_parameter_another(tmp_path):
    text = "effort,thrust_N\n-1,-85.1\n0.5,20\n"
    ids = [
        imported(tmp_path, text, "effort_static", **more)[1].recording_id for more in ({}, {}, {"nominal_voltage": 48})
    ]
    assert ids[0] == ids[1] != ids[2]
    _, recording, _ = imported(tmp_path, text, "effort_static")
    assert "nominal_voltage" in str(recording.attributes["import_map"])
    assert recording.attributes["imported_from"] == "in.csv"


def test_the_command_line(tmp_path):
    source = tmp_path / "m5.csv"
    source.write_text("effort,thrust_N\n-1,-85.1\n0.5,20\n")
    run = CliRunner()
    listed = run.invoke(import_command, ["--list"])
    assert listed.exit_code == 0
    assert "rcbenchmark" in listed.output
    arguments = [
        str(source),
        "--map",
        "effort_static",
        "--set",
        "nominal_voltage=48",
        "--thruster",
        "M5",
        "--kind",
        "tunnel",
    ]
    done = run.invoke(import_command, arguments, catch_exceptions=False)
    assert done.exit_code == 0
    assert "2 rows, 0 left out" in done.output
    recording = load(tmp_path / "m5.h5")
    assert (recording.thruster, recording.kind) == ("M5", "tunnel")
    assert recording.first_of("command_voltage").value[0] == -48
    assert "notes" not in recording.attributes
    wrong = run.invoke(import_command, [str(source), "--map", "effort_static", "--set", "nominal_voltage"])
    assert isinstance(wrong.exception, ConfigError)
