"""JSON in the words of the recording format: read as it is, or refused with the place that is wrong."""

import copy
import json

import numpy as np
import pytest
from click.testing import CliRunner

from rig.errors import ConfigError, RecordingError
from rig.hdf5 import load
from rig.importing.command import import_command
from rig.importing.one_file import import_plain

DOCUMENT = {
    "format": "thruster-rig-recording",
    "format_version": 1,
    "attributes": {"thruster": "ROMEO", "kind": "vehicle", "water_density": 1025.0},
    "streams": {
        "gyro": {
            "source": "any",
            "time": [0.0, 0.1, 0.2],
            "channels": {
                "heading": {
                    "quantity": "heading", "unit": "rad", "axis": "yaw", "noise_std": 0.005,
                    "calibration": {"gain_std": 0.01}, "value": [0.0, None, 0.2],
                },
                "raw": {"unit": "1", "value": [1, 2, 3]},
            },
        }
    },
    "steps": [{"phase": "hold", "command_voltage": 8.0, "t_start": 0.0, "t_end": 0.2}],
}  # fmt: skip


def test_what_is_written_is_read(tmp_path):
    source, out = tmp_path / "a.json", tmp_path / "a.h5"
    source.write_text(json.dumps(DOCUMENT))
    done = CliRunner().invoke(import_command, [str(source), "--notes", "smooth"], catch_exceptions=False)
    assert "3 rows" in done.output
    found = load(out)
    assert (found.thruster, found.kind, found.water_density, found.complete) == ("ROMEO", "vehicle", 1025.0, True)
    heading = found.first_of("heading")
    assert (heading.axis, heading.noise_std, heading.calibration["gain_std"]) == ("yaw", 0.005, 0.01)
    assert np.isnan(heading.value[1])
    assert [(step.phase, step.t_end) for step in found.steps] == [("hold", 0.2)]
    again = import_plain(source, tmp_path / "b.h5")
    assert load(again.path).recording_id == found.recording_id
    with pytest.raises(RecordingError, match="never overwritten"):
        import_plain(source, out)
    with pytest.raises(RecordingError, match="can't be read"):
        import_plain(tmp_path / "none.json", tmp_path / "c.h5")


def without(*path):
    def change(document):
        for key in path[:-1]:
            document = document[key]
        del document[path[-1]]

    return change


def heading(**facts):
    return lambda d: d["streams"]["gyro"]["channels"]["heading"].update(facts)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d.update(format="x"), "a table needs --map"),
        (lambda d: d.update(format_version=2), "format_version 2"),
        (lambda d: d["attributes"].update(kind="boat"), "known are tunnel, bollard, vehicle"),
        (lambda d: d["attributes"].update(notes=["x"]), "must be text, a number"),
        (lambda d: d["streams"]["gyro"].update(time=[0.0, 0.2, 0.1]), "ascend"),
        (lambda d: d["streams"]["gyro"].update(channels={}), "has no channel"),
        (heading(unit="deg"), "heading in 'deg', expected rad"),
        (heading(quantity="pose"), "expected one of"),
        (heading(value=[1.0]), "1 values at 3 times"),
        (without("streams"), "not as rig/importing/json_recording.py shows"),
        (without("streams", "gyro", "time"), "not as rig/importing/json_recording.py shows"),
    ],
)
def test_what_is_wrong_is_said_and_nothing_is_written(tmp_path, change, said):
    document = copy.deepcopy(DOCUMENT)
    change(document)
    source = tmp_path / "a.json"
    source.write_text(json.dumps(document))
    with pytest.raises(RecordingError) as caught:
        import_plain(source, tmp_path / "a.h5")
    assert said in str(caught.value)
    assert not list(tmp_path.glob("*.h5*"))


@pytest.mark.parametrize("option", [("--thruster", "T1"), ("--kind", "bollard"), ("--set", "nominal_voltage=48")])
def test_what_changes_a_map_is_refused_without_one(tmp_path, option):
    (tmp_path / "a.json").write_text(json.dumps(DOCUMENT))
    said = CliRunner().invoke(import_command, [str(tmp_path / "a.json"), *option])
    assert isinstance(said.exception, ConfigError)
    assert f"{option[0]} is for a map" in str(said.exception)
    assert not list(tmp_path.glob("*.h5*"))


def test_what_is_no_json_asks_for_a_map(tmp_path):
    (tmp_path / "a.csv").write_text("t,x\n0,1\n")
    with pytest.raises(RecordingError, match="needs --map"):
        import_plain(tmp_path / "a.csv", tmp_path / "a.h5")
