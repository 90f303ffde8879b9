"""`python -m sim_devices vehicle`: the file of the vehicle, recordings that load, and truth beside estimate."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from rig.hdf5 import load as load_recording
from sim_devices.__main__ import main
from sim_devices.tables import WorldError
from sim_devices.vehicle.documents import truth
from sim_devices.vehicle.settings import load, read
from sim_devices.vehicle.truth_table import compare, table

ROMEO = Path(__file__).resolve().parents[3] / "benches" / "romeo"


def test_the_example_is_as_its_file_says():
    found = load(ROMEO / "vehicle.toml")
    assert found.hull.eta_hull == 0.68
    assert found.hull.thrusters["T8"].C == 0.4498
    assert found.hull.current == (0.08, -0.05)
    assert truth(found.hull)["axes"]["heave"]["buoyancy[1]"] == -46.0


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"etahull": 0.5}, "did you mean 'eta_hull'?"),
        ({"thrusters": {"T9": 0.4}}, "unknown name 'T9'"),
        ({"thrusters": {"T1": -0.4}}, "above 0"),
        ({"axes": {"pitch": {}}}, "unknown name 'pitch'"),
        ({"axes": {"surge": {"inertia": -1.0, "linear": 1.0, "quadratic": 1.0}}}, "inertia must be above 0"),
        ({"noise": {"depht": 0.1}}, "depth"),
    ],
)
def test_what_is_wrong_with_it_is_named(content, said):
    with pytest.raises((WorldError, ValueError)) as caught:
        read(content)
    assert said in str(caught.value)


def test_a_file_that_is_none(tmp_path):
    for text in (None, "= 1", "[axes.surge]\ninertia = -1.0\nlinear = 1.0\nquadratic = 1.0\n"):
        path = tmp_path / "v.toml"
        if text is not None:
            path.write_text(text)
        with pytest.raises(WorldError, match=r"v\.toml|inertia"):
            load(path)
    result = CliRunner().invoke(main, ["vehicle", str(tmp_path / "no.toml"), str(tmp_path / "out")])
    assert result.exit_code == 2
    (tmp_path / "out").mkdir()
    result = CliRunner().invoke(main, ["vehicle", str(ROMEO / "vehicle.toml"), str(tmp_path / "out")])
    assert result.exit_code == 2
    assert "never overwritten" in result.output


def test_a_whole_campaign_becomes_recordings(tmp_path):
    out = tmp_path / "romeo"
    result = CliRunner().invoke(main, ["vehicle", str(ROMEO / "vehicle.toml"), str(out), "--seed", "3"])
    assert result.exit_code == 0, result.output
    assert len(list((out / "tunnel").glob("*.h5"))) == 8
    assert len(list((out / "trials").glob("*.h5"))) == 23
    run = load_recording(out / "tunnel" / "T6.h5")
    thrust, command = run.first_of("thrust"), run.first_of("command_voltage")
    assert thrust.calibration == {"gain_std": 0.005}
    held = command.held_at(thrust.time) == 16.0
    assert np.median(thrust.value[held]) == pytest.approx(0.342 * 256, rel=0.03)
    trial = load_recording(out / "trials" / "heave-3.h5")
    assert (trial.kind, trial.thruster) == ("vehicle", "ROMEO-like")
    assert {c.thruster for c in trial.all_of("command_voltage")} == {f"T{i}" for i in range(1, 9)}
    depth = trial.first_of("depth")
    assert (depth.axis, depth.noise_std) == ("heave", 0.005)
    assert np.diff(depth.time[:100]) == pytest.approx(0.1)
    assert {step.phase for step in trial.steps} == {"ramp", "hold"}


def answer(tmp_path, m, std):
    low, high = (m - 2 * std, m + 2 * std) if std is not None else (None, None)
    p = {"m": {"value": m, "std": std, "unit": "kg", "interval_95": [low, high]}}
    path = tmp_path / "answer.json"
    path.write_text(json.dumps({"axes": {"surge": {"parameters": p | {"eta_new": p["m"]}}}}))
    return path


def test_truth_beside_estimate(tmp_path):
    true = tmp_path / "truth.json"
    true.write_text(json.dumps(truth(load(ROMEO / "vehicle.toml").hull)))
    (row,) = compare(true, answer(tmp_path, 853.0, 2.0))
    assert row.inside
    assert row.z == pytest.approx(1.5)
    assert "1 of 1 intervals hold the truth" in table([row])
    (far,) = compare(true, answer(tmp_path, 900.0, 2.0))
    assert "one in twenty" in table([far])
    assert compare(true, answer(tmp_path, 900.0, None)) == []
    said = CliRunner().invoke(main, ["compare", str(true), str(answer(tmp_path, 853.0, 2.0))])
    assert "+1.5 std. errors off" in said.output
    wrong = CliRunner().invoke(main, ["compare", str(true), str(tmp_path / "none.json")])
    assert wrong.exit_code == 2
    (tmp_path / "list.json").write_text("[]")
    with pytest.raises(WorldError, match="expected JSON with 'axes'"):
        compare(true, tmp_path / "list.json")
