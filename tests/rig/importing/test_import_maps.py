"""Import: maps, right and wrong, and the command line."""

import pytest
from click.testing import CliRunner

from rig.errors import ConfigError, RecordingError
from rig.hdf5 import load
from rig.importing.command import import_command
from rig.importing.mapping import build_map, read_map, shipped
from tests.rig.importing.small_imports import imported, plan, values


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


def test_what_an_amplifier_does_is_said_in_the_recording(tmp_path):
    """Its group delay is in the delay, which is no less."""
    facts = {"column": 2, "unit": "N", "quantity": "thrust", "low_pass": 0.01, "window": 0.1, "filter": "RC, 16 Hz"}
    told = [{}, {"delay": 0.03, "delay_std": 0.002}]
    for more, delay in zip(told, (0.01, 0.03), strict=True):
        streams = {"a": {"channels": {"F": {**facts, **more}}}}
        _, _, found = imported(tmp_path, "t,F\n1,1\n2,2\n", plan(streams=streams))
        said = found["F"].acquisition
        assert (said.low_pass, said.window, said.delay, said.filter) == (0.01, 0.1, delay, "RC, 16 Hz")
    assert said.delay_std == 0.002


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"tiem": {}}, "unknown key tiem; did you mean time"),
        ({"file": {"headr": True}}, "test: file: unknown key headr; did you mean header"),
        ({"file": {"delimiter": "::"}}, "one character"),
        ({"file": 3}, "file must be a table"),
        ({"streams": 3}, "streams must be tables"),
        ({"time": {"column": 1, "rate": 5.0}}, "exactly one of column, rate, level_duration"),
        ({"time": {"column": 1, "unit": "fortnight"}}, "time.unit: time in 'fortnight'"),
        ({"columns": {"a": {"any": []}}}, "columns.a: unknown key any; did you mean any_of"),
    ],
)
def test_maps_that_are_wrong_name_the_key(change, says):
    with pytest.raises(ConfigError, match=says):
        build_map(plan(**change), "", "test")


@pytest.mark.parametrize(
    ("channel", "says"),
    [
        (
            {"quantity": "thrust", "unit": "stone", "column": 1},
            "thrust in 'stone': not a unit that is known for it; known are N, newton, mN",
        ),
        ({"quantity": "force", "unit": "N", "column": 1}, "force is no quantity"),
        ({"unit": "N"}, "either column or value"),
        ({"unit": "N", "value": "__import__('os')"}, "not allowed"),
        ({"unit": "N", "collumn": 1}, "did you mean column"),
        ({"unit": "N", "column": 1, "window": 100.0}, "window must be between 0 and 60 s, got 100"),
        ({"unit": "N", "column": 1, "low_pass": 0.2, "delay": 0.1}, "holds the group delay of low_pass"),
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
    with pytest.raises(ConfigError, match=r"m\.toml: not valid TOML: Invalid value"):
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
