"""`rig fit` on files: what a person reads, what a program reads, and what is refused."""

import json

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

from rig.errors import RecordingError
from rig.fit.command import fit_command, fit_files

LEVELS = (0.0, 6.0, -6.0, 12.0, -12.0, 0.0, 18.0, -18.0, 0.0)


def write(path, *, thruster="T3", C=0.4, C_minus=None, tare=1.5, seed=0, thrust=True, levels=LEVELS, version=1, **root):
    """A recording as another program would write it: no table of steps, command rows are changes."""
    n, rate = 100, 50.0
    rng = np.random.default_rng(seed)
    t = np.arange(n * len(levels)) / rate
    V = np.repeat(np.array(levels), n)
    F = np.where(V > 0, C, C_minus or C) * V * np.abs(V) + tare + rng.normal(0, 0.3, t.size)
    with h5py.File(path, "w") as file:
        file.attrs.update(format="thruster-rig-recording", format_version=version, recording_id=path.stem)
        file.attrs.update(created="2026-01-01T00:00:00Z", complete=True, outcome="completed", thruster=thruster, **root)
        command = file.create_group("streams/command")
        command["time"] = np.arange(len(levels)) * n / rate
        command["command_voltage"] = np.array(levels)
        command["command_voltage"].attrs.update(quantity="command_voltage", unit="V")
        cell = file.create_group("streams/load_cell")
        cell["time"] = t
        if thrust:
            cell["thrust"] = F
            cell["thrust"].attrs.update(quantity="thrust", unit="N", calibration=json.dumps({"gain_std": 0.0005}))
    return path


def run(*arguments):
    return CliRunner().invoke(fit_command, [str(a) for a in arguments])


def test_json_is_the_stable_schema(tmp_path):
    out = tmp_path / "fit.json"
    files = [
        write(tmp_path / "a.h5"),
        write(tmp_path / "b.h5", seed=1, tare=-3.0),
        write(tmp_path / "c.h5", thruster="T1"),
    ]
    result = run(*files, "--json", out)
    assert result.exit_code == 0, result.output
    found = json.loads(out.read_text())
    assert (found["format"], found["version"]) == ("thruster-rig-fit", 1)
    assert [fit["thruster"] for fit in found["fits"]] == ["T3", "T1"]
    first = found["fits"][0]
    assert first["model"] == "C V|V|"
    assert first["recordings"] == ["a", "b"]
    assert first["parameters"]["C"]["value"] == pytest.approx(0.4, abs=0.002)
    assert first["parameters"]["C"]["unit"] == "N/V^2"
    assert first["parameters"]["C"]["std_calibration"] == pytest.approx(0.0002, rel=0.01)
    assert first["tare"]["b"]["value"] == pytest.approx(-3.0, abs=0.1)
    assert first["tare"]["a"]["unit"] == "N"
    assert first["rmse_of"] == "points"
    assert first["rmse"] < 0.1
    assert 0.2 < first["chi2_per_dof"] < 3
    assert first["alternatives"][0]["model"] == "C+/C-"
    assert set(first["alternatives"][0]["parameters"]) == {"C_plus", "C_minus"}
    assert len(first["points"]) == 2 * len(LEVELS)


def test_text_says_what_was_found(tmp_path):
    result = run(write(tmp_path / "a.h5", C_minus=0.36))
    assert result.exit_code == 0
    assert "T3: thrust = C V|V| with C = 0.3" in result.output
    assert "C_minus" in result.output
    assert "use --model C+/C-" in result.output


def test_model_can_be_chosen_and_json_printed(tmp_path):
    result = run(write(tmp_path / "a.h5"), "--model", "C+/C-", "--json", "-")
    found = json.loads(result.output)["fits"][0]
    assert found["model"] == "C+/C-"
    assert found["alternatives"][0]["model"] == "C V|V|"


def test_one_direction_gives_null_not_nan(tmp_path):
    result = run(write(tmp_path / "a.h5", levels=(0.0, 5.0, 10.0, 15.0)), "--model", "C+/C-", "--json", "-")
    assert json.loads(result.output)["fits"][0]["parameters"]["C_minus"]["std"] is None


def test_least_squares_gives_no_chi_square(tmp_path):
    result = run(write(tmp_path / "a.h5"), "--method", "ls", "--json", "-")
    found = json.loads(result.output)["fits"][0]
    assert found["chi2_per_dof"] is None
    assert found["sigma"] > 0


def test_a_folder_stands_for_its_recordings(tmp_path):
    write(tmp_path / "a.h5")
    assert fit_files([tmp_path])[0].fit.recordings == ("a",)
    (tmp_path / "empty").mkdir()
    with pytest.raises(RecordingError, match="folder without recordings"):
        fit_files([tmp_path / "empty"])
    with pytest.raises(RecordingError, match="no recording was given"):
        fit_files([])


def test_an_aborted_run_is_used_and_said(tmp_path):
    path = write(tmp_path / "a.h5")
    with h5py.File(path, "r+") as file:
        file.attrs["outcome"] = "aborted"
    assert "was aborted" in run(path).output


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda p: p.write_text("no recording") and p, "a.h5"),
        (lambda p: p, "a.h5"),
        (lambda p: write(p, thrust=False), "no channel of quantity thrust"),
        (lambda p: write(p, levels=(3.0, 3.0)), "at least two are needed"),
        (lambda p: write(p, kind="vehicle"), "vehicle trial"),
        (lambda p: write(p, version=9), "9"),
    ],
)
def test_what_cannot_be_used_ends_with_2_and_one_sentence(tmp_path, make, expected):
    result = run(make(tmp_path / "a.h5"))
    assert result.exit_code == 2
    assert expected in result.output
    assert len(result.output.strip().splitlines()) == 1


def test_the_same_recording_twice_is_refused(tmp_path):
    path = write(tmp_path / "a.h5")
    result = run(path, path)
    assert result.exit_code == 2
    assert "give it once" in result.output


def test_answer_that_cannot_be_written_ends_with_2(tmp_path):
    result = run(write(tmp_path / "a.h5"), "--json", tmp_path / "nowhere" / "fit.json")
    assert result.exit_code == 2


def by_rate(path, *, signed=True, name="rotation_rate"):
    """A sine by rotation rate, no voltage: C_t = 0.03 N.s^2."""
    t = np.arange(2000) / 50.0
    n = 20 * np.sin(2 * np.pi * t / 10)
    F = 0.03 * n * np.abs(n) + 1.0 + np.random.default_rng(0).normal(0, 0.2, t.size)
    with h5py.File(path, "w") as file:
        file.attrs.update(format="thruster-rig-recording", format_version=1, recording_id=path.stem, thruster="T3")
        file.attrs.update(created="2026-01-01T00:00:00Z", complete=True, outcome="completed")
        for stream, channel, value, unit in (("cell", "thrust", F, "N"), ("motor", name, n, "rev/s")):
            group = file.create_group(f"streams/{stream}")
            group["time"] = t
            group[channel] = value if signed or stream == "cell" else np.abs(value)
            group[channel].attrs.update(quantity=channel, unit=unit)
    return path


def test_without_a_voltage_the_rotation_rate_explains_the_thrust(tmp_path):
    path = by_rate(tmp_path / "n.h5")
    found = json.loads(run(path, "--json", "-").output)["fits"][0]
    assert found["model"] == "C_t n|n|"
    assert found["parameters"]["C_t"]["value"] == pytest.approx(0.03, rel=0.02)
    assert found["parameters"]["C_t"]["unit"] == "N.s^2/rev^2"
    assert set(found["alternatives"][0]["parameters"]) == {"C_t_plus", "C_t_minus"}
    assert "explained by rotation_rate" in run(path).output
    assert run(path, "--against", "rotation_rate").output == run(path, "--voltage", "rotation_rate").output


def test_a_tachometer_without_direction_is_said_first(tmp_path):
    said = run(by_rate(tmp_path / "n.h5", signed=False)).output
    assert "this fit means nothing" in said
    assert "means nothing" not in run(by_rate(tmp_path / "m.h5")).output


def test_volts_and_rates_are_not_mixed(tmp_path):
    result = run(by_rate(tmp_path / "n.h5"), write(tmp_path / "a.h5"))
    assert result.exit_code == 2
    assert "some have a voltage" in result.output


def test_two_thrusters_are_fitted_apart(tmp_path):
    files = [write(tmp_path / "a.h5"), write(tmp_path / "b.h5", thruster="T1", C=0.3)]
    found = json.loads(run(*files, "--json", "-").output)["fits"]
    assert [f["thruster"] for f in found] == ["T3", "T1"]
    assert found[1]["parameters"]["C"]["value"] == pytest.approx(0.3, abs=0.003)


def with_thrust(path, value):
    write(path)
    with h5py.File(path, "r+") as file:
        cell = file["streams/load_cell"]
        cell["thrust"][:] = value(cell["thrust"][:])
    return path


def test_nothing_but_nan_is_refused_and_few_samples_say_that_nothing_is_known(tmp_path):
    result = run(with_thrust(tmp_path / "a.h5", lambda F: F * np.nan))
    assert result.exit_code == 2
    assert "are missing" in result.output
    assert len(result.output.strip().splitlines()) == 1
    few = with_thrust(tmp_path / "b.h5", lambda F: np.where(np.isin(np.arange(F.size), (50, 150, 250)), F, np.nan))
    result = run(few)
    assert result.exit_code == 0, result.output
    assert "3 points" in result.output or "3 samples" in result.output


def test_long_names_and_large_numbers_do_not_run_together(tmp_path):
    """A thruster of a name of 27 letters, thrust a million times larger than ours."""
    name = "starboard aft, 2026-11-24 b"
    files = [write(tmp_path / "a.h5", thruster=name, C=4e5, tare=1e8), write(tmp_path / "b.h5", C=3e5)]
    lines = run(*files).output.splitlines()
    (row,) = [line for line in lines if line.startswith(f"  {name}")]
    assert row.removeprefix(f"  {name}").split()[:2] == ["C", "400000"]
    tare = next(line for line in lines if line.strip().startswith("tare "))
    assert tare.split()[1].startswith("1000000")
    assert all(float(cell) for cell in tare.split()[1:5])
