"""What a bench file may name as a calibration, and the sentence where it is none."""

import json
import shutil

import pytest

from identification.calibration.curve import Curve
from rig.campaign.calibration_file import FORMAT, read_cell
from rig.campaign.loading import load_bench
from rig.errors import ConfigError
from tests.rig.calibrate.weighing_bench import ROOT

CURVE = Curve(0.1, (1.01, 0.0, 0.0, 0.0), ((1e-8, 0, 0, 0), (0,) * 4, (0,) * 4, (0,) * 4), -100.0, 100.0, 30.0)
SOUND = {
    "format": FORMAT, "format_version": 1, "device": "load_cell", "device_id": "cell 7", "curve": CURVE.as_json(),
    "recording": {"recording_id": "abc"},
}  # fmt: skip


def bench(folder, name="load_cell", **changes):
    path = folder / "bench.toml"
    shutil.copy(ROOT / "benches" / "simulated" / "bench.toml", path)
    with path.open("a") as file:
        file.write(f'\n[calibration.{name}]\ndate = 2026-11-26\nfile = "cell.json"\n')
    (folder / "cell.json").write_text(json.dumps(SOUND | changes))
    return path


def test_the_curve_is_read_with_the_bench(tmp_path):
    found = load_bench(bench(tmp_path)).curves["load_cell"]
    assert found.curve == CURVE
    assert (found.identity, found.recording_id, found.path.name) == ("cell 7", "abc", "cell.json")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"format": "fits"}, "expected a file with the format 'thruster-rig-calibration'"),
        ({"format_version": 2}, "format_version 2; this rig reads 1"),
        ({"device": "other"}, "is a calibration of the device 'other', not of 'load_cell'"),
        ({"curve": {}}, "a calibration's curve lacks 'range'; calibrate again"),
    ],
)
def test_what_is_no_calibration_of_this_device(tmp_path, changes, said):
    with pytest.raises(ConfigError, match=said):
        load_bench(bench(tmp_path, **changes))


def test_a_file_that_is_not_there_or_no_json(tmp_path):
    path = bench(tmp_path)
    (tmp_path / "cell.json").write_text("{")
    with pytest.raises(ConfigError, match="is no JSON"):
        load_bench(path)
    (tmp_path / "cell.json").unlink()
    with pytest.raises(ConfigError, match=r"there is no such file; calibrate again with `rig calibrate`, or take"):
        load_bench(path)
    with pytest.raises(ConfigError, match="no such file"):
        read_cell(tmp_path / "none.json", "load_cell")


def test_what_has_no_thrust_is_not_calibrated_with_weights(tmp_path):
    with pytest.raises(ConfigError, match=r"calibration\.thermometer\.file: thermometer measures no thrust"):
        load_bench(bench(tmp_path, "thermometer", device="thermometer"))


def test_the_motor_is_no_load_cell(tmp_path):
    with pytest.raises(ConfigError, match=r"calibration\.motor\.file: dead weights calibrate a load cell"):
        load_bench(bench(tmp_path, "motor", device="motor"))
