"""rig diagnose against a saved model: the same thruster, a worn one, a file that is broken."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from rig.errors import TwinError
from rig.twin.reading import read_twin
from rig.twin.writing import twin_json, write_twin
from tests.rig.diagnose.diagnosed_files import bad, dead_band, run


def test_against_its_own_twin_the_same_recording_is_adequate(dead):
    path, _, twin, _ = dead
    result = run("diagnose", path, "--twin", twin, "--json", "-")
    said = json.loads(result.output)
    assert said["verdict"] == "adequate", said["statement"]
    assert "the twin dead.twin.json" in said["baseline"]["model"]
    assert any("half_width" in name or "." in name for name in said["baseline"]["parameters"])


def test_a_thruster_that_lost_thrust_is_told_from_its_twin(folder, dead):
    _, _, twin, _ = dead

    def weaker(columns: dict) -> None:
        dead_band(columns)
        time, thrust, *rest = columns["cell"]
        columns["cell"] = (time, 0.95 * thrust, *rest)

    said = json.loads(
        run("diagnose", bad.recording(folder / "weak.h5", seed=4, change=weaker), "--twin", twin, "--json", "-").output
    )
    changed = {f["effect"]: f for f in said["findings"]}["thrust_constant"]
    assert abs(changed["parameters"]["C"]["value"] / changed["parameters"]["before"]["value"] - 0.95) < 0.01


def test_a_twin_file_reads_back_as_it_was_written(dead, tmp_path):
    _, _, path, _ = dead
    twin = read_twin(path)
    write_twin(twin, tmp_path / "again.json")
    assert json.loads(json.dumps(twin_json(read_twin(tmp_path / "again.json")))) == json.loads(path.read_text())
    assert len(twin.sources[0].sha256) == 64
    wider = replace(twin, constant_interval=(0.9 * twin.C, 1.3 * twin.C))
    write_twin(wider, tmp_path / "wider.json")
    assert read_twin(tmp_path / "wider.json").constant_interval == wider.constant_interval
    assert np.array(twin.covariance).shape == (len(twin.names),) * 2


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.update(format="other"), "its format is 'other'"),
        (lambda t: t.update(version=3), "is later than 2"),
        (lambda t: t.pop("C"), "C is missing"),
        (lambda t: t.update(C="much"), "C must be a finite number, got 'much'"),
        (lambda t: t.update(C_interval=[0.0, 1e-9]), "C_interval must be two numbers with C between them"),
        (lambda t: t.update(driver="wind"), "driver must be one of command_voltage"),
        (lambda t: t["terms"][0].update(effect="gremlin"), "must be an effect of the catalogue"),
        (lambda t: t["terms"][0].update(form="odd"), "must be a form of"),
        (lambda t: t["terms"][0]["parameters"].clear(), "is missing"),
        (lambda t: t["terms"][0]["parameters"].update(colour={"value": 1}), "has colour; the parameters of"),
        (lambda t: next(iter(t["terms"][0]["parameters"].values())).update(value=1e9), "must be within"),
        (lambda t: next(iter(t["terms"][0]["parameters"].values())).update(unit="furlong"), "unit must be"),
        (lambda t: t["covariance"]["matrix"].pop(), "rows of"),
        (lambda t: t["covariance"]["names"].reverse(), "in the order of C and the terms"),
        (lambda t: t["covariance"]["matrix"][0].__setitem__(1, 1.0), "symmetric"),
        (lambda t: t["noise"].update(scales=[1.0]), "as long as scales"),
        (lambda t: t.update(recordings="none"), "a list of objects"),
    ],
)
def test_a_broken_twin_is_one_sentence(dead, tmp_path, change, words):
    content = json.loads(dead[2].read_text())
    if content["noise"]["scales"] and "scales" in words:
        content["noise"]["slow"] = [1.0, 1.0]
    change(content)
    path = tmp_path / "broken.json"
    path.write_text(json.dumps(content))
    with pytest.raises(TwinError) as error:
        read_twin(path)
    assert words in str(error.value)
    assert "\n" not in str(error.value)
