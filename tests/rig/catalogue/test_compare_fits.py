"""`rig compare-fits`: known changes are found, none are not, and a shared calibration cancels."""

import json
import re
from pathlib import Path

import h5py
import numpy as np
import pytest

from rig.catalogue.fit_history import DatedFit, history
from rig.cli import main
from tests.rig.catalogue.small_files import fit, recording
from tests.rig.fit.test_fit_comparison import write

PAGE = Path(__file__).parents[3] / "docs" / "howto" / "catalogue.md"


@pytest.fixture
def run(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / ".cache"))

    def run(*arguments, status=0):
        capfd.readouterr()
        assert main(["compare-fits", *(str(each) for each in arguments)]) == status
        return capfd.readouterr()

    return run


@pytest.fixture
def found(run):
    return lambda *arguments: json.loads(run(*arguments, "--json", "-").out)


def fits_of(folder, values, **same):
    """Fits in March, April ... of recordings that lie beside them."""
    for k, C in enumerate(values):
        recording(folder / f"{k}.h5", f"id-{k}", created=f"2026-{k + 3:02}-01T00:00:00Z")
        fit(folder / f"{k}.json", recordings=[f"id-{k}"], C=C, **same)
    return [f"{k}.json" for k in range(len(values))]


def test_a_change_is_found_against_the_first_and_the_one_before(tmp_path, run, found):
    files = fits_of(tmp_path, [0.4, 0.4005, 0.42, 0.42])
    told = found(*reversed(files))
    assert [each["source"] for each in told["fits"]] == files
    assert [each["began"][:7] for each in told["fits"]] == ["2026-03", "2026-04", "2026-05", "2026-06"]
    changed = {(pair["earlier"], pair["later"]): pair["changed"] for pair in told["pairs"]}
    assert changed == {(0, 1): False, (0, 2): True, (1, 2): True, (0, 3): True, (2, 3): False}
    first = told["pairs"][0]
    assert first["against"] == "first and previous"
    assert first["difference"] == pytest.approx(0.0005)
    assert first["std"] == pytest.approx(0.001 * 2**0.5)
    assert told["fits"][0]["parameters"]["C"]["expanded_k2"] == pytest.approx(0.002)
    text = run(*files).out
    assert "T1 has changed since fit 1 (2026-03-01 00:00): C of fit 4 is 5.0" in text
    assert "not at 5 %" in text
    assert told["changed"]


def test_no_change_says_what_would_have_been_seen(tmp_path, run):
    text = run(*fits_of(tmp_path, [0.4, 0.4002])).out
    assert "T1 has not changed measurably since fit 1" in text
    assert "would have been seen in 80 % of cases" in text


@pytest.mark.parametrize(
    ("second", "std"), [("cell A", 0.001 * 2**0.5), ("cell B", (2 * 0.001**2 + 2 * 0.004**2) ** 0.5)]
)
def test_the_error_of_a_calibration_cancels_only_where_it_is_shared(tmp_path, found, second, std):
    fit(tmp_path / "a.json", recordings=["id-1"], gain_std=0.01, calibration="cell A")
    fit(tmp_path / "b.json", recordings=["id-2"], gain_std=0.01, calibration=second)
    told = found("a.json", "b.json")
    assert told["pairs"][0]["std"] == pytest.approx(std, rel=1e-3)
    assert told["pairs"][0]["shared_calibration"] == (second == "cell A")
    assert any("cancels" in note for note in told["notes"]) == (second == "cell A")
    assert any("each gain error counts in full" in note for note in told["notes"]) == (second != "cell A")


def test_false_alarms_are_as_many_as_are_said():
    """Of 400 histories of five fits in which nothing changed 5 % may say that it did; chance adds up to 3.3 %."""
    rng, dof, alarms, missed = np.random.default_rng(1), 8, 0, 0
    for _ in range(400):
        for shift in (0.0, 0.01):
            std = 0.001 * np.sqrt(rng.chisquare(dof, 5) / dof)
            values = 0.4 + 0.001 * rng.standard_normal(5) + shift * (np.arange(5) > 2)
            told = history(
                "T1", "C V|V|", [dated(k, C, s, dof) for k, (C, s) in enumerate(zip(values, std, strict=True))]
            )
            alarms += told.changed and not shift
            missed += not told.changed and shift > 0
    assert alarms / 400 < 0.083
    assert missed / 400 < 0.05


def dated(k, C, std, dof):
    parameter = {"value": C, "std": std, "unit": "N/V^2", "std_statistical": std, "std_calibration": 0.0, "dof": dof}
    entry = {
        "model": "C V|V|",
        "parameters": {"C": parameter},
        "recordings": [str(k)],
        "calibration": "cell",
        "rmse": 0.1,
    }
    return DatedFit(str(k), float(k), entry | {"covariance": {"statistical": [[std**2]]}})


def test_recordings_of_a_thruster_are_fitted_on_the_way(tmp_path, run, found):
    for k, (C, campaign) in enumerate([(0.4, "a"), (0.4, "a"), (0.41, "b")]):
        path = write(tmp_path / f"r{k}.h5", C=C, seed=k, thruster="T3")
        with h5py.File(path, "r+") as file:
            file.attrs["created"], file.attrs["campaign"] = f"2026-0{3 + k}-01T00:00:00Z", campaign
    told = found("--thruster", "T3", tmp_path)
    assert [len(each["recordings"]) for each in told["fits"]] == [2, 1]
    assert told["changed"]
    assert told["pairs"][0]["shared_calibration"]
    assert any("recordings of the same thruster" in note for note in told["notes"])
    assert "2 fits of T3 are needed" not in run("r0", "r2.h5").out
    assert "two fits of T3 are needed, 1 came" in run("--thruster", "T3", "--since", "2026-04-02", status=2).err


def test_what_can_not_be_compared_is_said(tmp_path, run, found):
    fits_of(tmp_path, [0.4, 0.41, 0.42])
    fit(tmp_path / "other.json", thruster="T2", recordings=["id-9"])
    assert "which thruster?" in run("0.json", "other.json", status=2).err
    assert "whose fits?" in run(status=2).err
    assert "neither a file nor the beginning of an id" in run("0.json", "nix", status=2).err
    again = fit(tmp_path / "again.json", recordings=["id-0"])
    assert "is in 0.json too" in found("0.json", "1.json", again)["notes"][-1]
    by_rate = fit(tmp_path / "rate.json", recordings=["id-7"], voltage="rotation_rate")
    assert "fitted over rotation_rate" in found("0.json", "1.json", by_rate)["notes"][-1]
    odd = tmp_path / "odd.json"
    odd.write_text(
        (tmp_path / "2.json").read_text().replace('"dof": ', '"dof": "many", "was": ').replace("id-2", "id-8")
    )
    assert "is not as thruster-rig-fit has it" in found("0.json", "1.json", odd)["notes"][-1]
    assert "--since" in run("0.json", "1.json", "--since", "2026-01-01", status=2).err


def test_every_key_of_the_json_is_on_the_page(tmp_path, found):
    seen = set(re.findall(r"`([^`\n]+)`", PAGE.read_text(encoding="utf-8")))
    told = found(*fits_of(tmp_path, [0.4, 0.41]))
    parts = [told, told["fits"][0], told["fits"][0]["parameters"]["C"], told["pairs"][0]]
    assert {key for part in parts for key in part} <= seen
