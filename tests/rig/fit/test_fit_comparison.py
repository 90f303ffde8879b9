"""`rig fit` with rotation rate and flow, for several thrusters, and against an earlier fit."""

import json

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

from rig.fit.command import fit_command

LEVELS = (0.0, 6.0, -6.0, 12.0, -12.0, 0.0, 18.0, -18.0, 0.0)


def write(path, *, thruster="T3", C=0.4, seed=0, rate=False, flow=0.0, C_s=2.0, gain_std=0.0005, levels=LEVELS):
    """Holds of 2 s. `rate`: n by alpha = 0.25, gamma = 3, k = 1, integrated in steps of 1 ms."""
    every, hold = 50.0, 2.0
    rng = np.random.default_rng(seed)
    V = np.repeat(np.array(levels), int(hold * 1000))
    n, speed = 0.0, np.empty(V.size)
    for i, v in enumerate(V.tolist()):
        speed[i] = n
        n += 1e-3 * (0.25 * (v * abs(v) - n * abs(n)) + 3.0 * (v - n))
    pick = np.arange(0, V.size, int(1000 / every))
    t, n, v = pick / 1000, (speed if rate else V)[pick], V[pick]
    F = C * n * np.abs(n) - C_s * np.abs(v) * flow + 1.5 + rng.normal(0, 0.1, t.size)
    streams = {"cell": {"thrust": (t, F, "N")}}
    streams["command"] = {"command_voltage": (np.arange(len(levels)) * hold, np.array(levels), "V")}
    if rate:
        streams["motor"] = {"rotation_rate": (t, n + rng.normal(0, 0.01, t.size), "rev/s")}
    if flow:
        streams["flow"] = {"flow_speed": (t[::12], flow + rng.normal(0, 0.004, t[::12].size), "m/s")}
    with h5py.File(path, "w") as file:
        file.attrs.update(format="thruster-rig-recording", format_version=1, recording_id=path.stem)
        file.attrs.update(created="2026-01-01T00:00:00Z", complete=True, outcome="completed", thruster=thruster)
        for stream, channels in streams.items():
            group = file.create_group(f"streams/{stream}")
            for channel, (time, value, unit) in channels.items():
                group["time"], group[channel] = time, value
                group[channel].attrs.update(quantity=channel, unit=unit)
        file["streams/cell/thrust"].attrs["calibration"] = json.dumps({"gain_std": gain_std})
    return path


def run(*arguments):
    return CliRunner().invoke(fit_command, [str(a) for a in arguments])


def document(*arguments):
    result = run(*arguments, "--json", "-")
    assert result.exit_code == 0, result.output
    return json.loads(result.output)


def test_rate_and_flow_bring_their_models_and_the_plain_one_stays_first(tmp_path):
    path = write(tmp_path / "a.h5", rate=True, flow=0.6)
    found = document(path)["fits"][0]
    names = [candidate["model"] for candidate in found["models"]]
    assert names[:2] == ["C V|V|", "C+/C-"]
    assert {"C V|V| - C_s|V|U", "C_t n|n|", "C_t n|n| - C_s|n|U"} <= set(names)
    assert "C_s" in found["models_say"]
    assert found["model"] == "C V|V|"
    flow = document(path, "--model", "flow")["fits"][0]
    assert flow["parameters"]["C_s"]["value"] == pytest.approx(2.0, rel=0.05)
    assert flow["significance"]["C_s"]["significant"]
    assert flow["without"]["C_s"]["rmse"] > 5 * flow["rmse"]
    assert flow["without"]["C_s"]["parameters"]["C"]["value"] == pytest.approx(0.4, rel=0.1)
    text = run(path).output
    assert "models side by side" in text
    assert "without C:" in text
    by_rate = document(path, "--model", "C_t n|n| - C_s|n|U")["fits"][0]
    assert by_rate["parameters"]["C_t"]["unit"] == "N.s^2/rev^2"


def test_rotor_is_found_where_the_rate_was_recorded_and_missed_aloud_where_not(tmp_path):
    path = write(tmp_path / "a.h5", rate=True)
    found = document(path, "--model", "dynamics")["fits"][0]
    assert found["model"] == "C_t n|n|"
    rotor = found["dynamics"]
    assert rotor["parameters"]["alpha"]["value"] == pytest.approx(0.25, rel=0.05)
    assert rotor["parameters"]["k"]["value"] == pytest.approx(1.0, rel=0.01)
    assert rotor["beta"]["value"] == pytest.approx(0.25, rel=0.05)
    assert rotor["covariance"]["names"] == ["alpha", "k", "gamma", "delay"]
    constants = {level["voltage"]: level["time_constant"] for level in rotor["levels"]}
    assert constants[18.0] == pytest.approx(1 / (3 + 2 * 0.25 * 18), rel=0.03)
    assert "gamma is significant" in run(path).output
    bare = write(tmp_path / "b.h5")
    assert "no rotation_rate was recorded" in document(bare)["fits"][0]["dynamics"]["reason"]
    assert "rotor: recording" in run(bare).output
    refused = run(bare, "--model", "dynamics")
    assert refused.exit_code == 2
    assert len(refused.output.strip().splitlines()) == 1


def test_eight_thrusters_are_one_table_and_the_odd_one_is_named(tmp_path):
    files = [write(tmp_path / f"T{i}.h5", thruster=f"T{i}", C=0.41 if i == 5 else 0.4, seed=i) for i in range(1, 9)]
    found = document(*files)
    same = found["comparison"]
    assert same["differ"]
    assert same["different_thrusters"] == ["T5"]
    assert same["rest_p"] > 0.01
    assert same["shared_calibration"]
    assert len(same["pairs"]) == 28
    shared = found["coefficients"]
    assert shared["names"][4] == "C[T5]"
    cov = np.array(shared["covariance"], dtype=float)
    assert cov[0, 1] == pytest.approx(0.0005**2 * 0.16, rel=0.01)
    assert np.linalg.eigvalsh(cov).min() > 0
    text = run(*files).output
    assert "T5 differs from the rest" in text
    assert text.index("thrusters differ") < text.index("T1: thrust =")


def test_alike_thrusters_and_repeated_recordings(tmp_path):
    files = [
        write(tmp_path / f"T{i}-{k}.h5", thruster=f"T{i}", C=0.4 * (1 + 0.02 * (-1) ** k), seed=10 * i + k)
        for i in (1, 2)
        for k in (1, 2)
    ]
    found = document(*files)["comparison"]
    assert not found["differ"]
    assert found["repeatability"]["relative_std"] == pytest.approx(0.028, rel=0.2)
    text = run(*files).output
    assert "thrusters do not differ" in text
    assert "from one to the next" in text


def test_a_change_since_an_earlier_campaign_is_tested(tmp_path):
    old = [write(tmp_path / f"old{i}.h5", thruster=f"T{i}", seed=i) for i in (1, 2)]
    earlier = tmp_path / "old.json"
    assert run(*old, "--json", earlier).exit_code == 0
    new = [write(tmp_path / f"new{i}.h5", thruster=f"T{i}", seed=9 + i, C=0.4 + 0.01 * (i == 2)) for i in (1, 2, 3)]
    changes = document(*new, "--compare", earlier)["changes"][0]
    first, second = changes["changes"]
    assert not first["changed"]
    assert second["changed"]
    assert second["relative_interval_95"][0] < 0.025 < second["relative_interval_95"][1]
    assert 0 < second["smallest_seen"] < 0.01
    assert second["shared_calibration"]
    assert "not in the earlier fit" in changes["notes"][0]
    text = run(*new, "--compare", earlier).output
    assert "T2 has changed" in text
    assert "T1 has not changed measurably" in text
    assert "80 % of cases" in text
    other_cell = write(tmp_path / "cell.h5", thruster="T1", seed=30, gain_std=0.02)
    assert not document(other_cell, "--compare", earlier)["changes"][0]["changes"][0]["shared_calibration"]


def test_a_fit_written_before_the_covariance_can_still_be_compared(tmp_path):
    earlier = tmp_path / "old.json"
    run(write(tmp_path / "old.h5"), "--json", earlier)
    content = json.loads(earlier.read_text())
    for key in ("covariance", "calibration", "significance", "models", "without", "dynamics"):
        content["fits"][0].pop(key)
    earlier.write_text(json.dumps(content))
    (change,) = document(write(tmp_path / "new.h5", seed=1), "--compare", earlier)["changes"][0]["changes"]
    assert not change["changed"]
    assert not change["shared_calibration"]


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("no json", "expected the JSON"),
        ("[]", "expected a file of format"),
        ('{"format": "thruster-rig-fit", "version": 7}', "version 7"),
        ('{"format": "thruster-rig-fit", "version": 1, "fits": [{}]}', "is not as"),
    ],
)
def test_what_is_no_earlier_fit_is_refused_with_a_sentence(tmp_path, content, expected):
    earlier = tmp_path / "old.json"
    earlier.write_text(content)
    result = run(write(tmp_path / "a.h5"), "--compare", earlier)
    assert result.exit_code == 2
    assert expected in result.output
    assert len(result.output.strip().splitlines()) == 1


def test_the_same_recording_or_another_model_is_not_compared(tmp_path):
    path, earlier = write(tmp_path / "a.h5"), tmp_path / "old.json"
    run(path, "--json", earlier)
    assert "is in both fits" in document(path, "--compare", earlier)["changes"][0]["notes"][0]
    by_rate = write(tmp_path / "b.h5", rate=True)
    notes = document(by_rate, "--against", "rotation_rate", "--compare", earlier)["changes"][0]["notes"]
    assert "has no C_t n|n|" in notes[0]
    assert run(path, "--compare", tmp_path / "none.json").exit_code == 2


def test_covariance_is_in_the_json(tmp_path):
    found = document(write(tmp_path / "a.h5"), "--model", "C+/C-")["fits"][0]
    assert found["covariance"]["names"] == ["C_plus", "C_minus", "tare[a]"]
    cov = np.array(found["covariance"]["matrix"], dtype=float)
    assert np.sqrt(cov[0, 0]) == pytest.approx(found["parameters"]["C_plus"]["std"])
    assert found["parameters"]["C_plus"]["std_uncorrected"] > 0
    assert found["significance"]["C_plus"]["percent_uncorrected"] > 0


def test_rows_out_of_order_are_said(tmp_path):
    path = write(tmp_path / "a.h5")
    with h5py.File(path, "r+") as file:
        time = file["streams/cell/time"]
        time[...] = time[...][::-1]
    result = run(path)
    assert result.exit_code == 2
    assert "899 rows left out: time not finite or running back" in result.output
    with h5py.File(path, "r+") as file:
        time = file["streams/cell/time"]
        time[...] = time[...][::-1]
        time[5] = 0.0
    assert any("running back" in text for text in document(path)["fits"][0]["verdicts"])
