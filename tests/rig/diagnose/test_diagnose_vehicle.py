"""rig diagnose of a vehicle from the command line: text, JSON and page; a sentence and exit status 2 for bad input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from identification.recording import Recording
from rig.cli import rig
from rig.diagnose.vehicle import VehicleFiles, setup_of
from rig.importing.one_file import import_plain
from tests.rig.report_reading import open_fonts

INSTALLATION = """
[vehicle]
name = "boat"
current = false
[thrusters]
T1 = { surge = 1.0, C = 0.4, C_std = 0.002 }
[known.surge]
m = { value = 100.0, std = 1.0 }
"""


def run(*arguments: object) -> Result:
    return CliRunner().invoke(rig, [str(a) for a in arguments])


def boat(seed: int, axis: str = "surge", kind: str = "vehicle") -> dict[str, object]:
    """m = 100 kg, k2 = 40 N/(m/s)^2, C = 0.4 N/V^2, levels for 15 s each; linear drag of 30 N/(m/s) in the water."""
    rng, h = np.random.default_rng(seed), 0.02
    t = np.arange(0.0, 90.0, h)
    level = np.array([4.0, -8.0, 12.0, 2.0, -12.0, 6.0])[np.minimum((t / 15).astype(int), 5)]
    v = np.zeros(t.size)
    for i in range(t.size - 1):
        push = 0.4 * level[i] * abs(level[i])
        v[i + 1] = v[i] + h * (push - 30 * v[i] - 40 * abs(v[i]) * v[i]) / 100
    speed = v[::10] + 0.01 * rng.standard_normal(t[::10].size)
    command = {
        "quantity": "command_voltage",
        "unit": "V",
        "value": level[::10].tolist(),
        "thruster": "T1",
        "axis": axis,
    }
    channels = {
        "command": command,
        "speed": {"quantity": "speed", "unit": "m/s", "value": speed.tolist(), "axis": axis},
    }
    if kind == "tunnel":
        channels["thrust"] = {"quantity": "thrust", "unit": "N", "value": speed.tolist()}
    return {
        "format": "thruster-rig-recording",
        "format_version": 1,
        "attributes": {"thruster": "boat", "kind": kind},
        "streams": {"log": {"source": "simulated", "time": t[::10].tolist(), "channels": channels}},
        "steps": [],
    }


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    open_fonts()
    out = tmp_path_factory.mktemp("boat")
    for name, one in (
        ("one", boat(1)),
        ("two", boat(2)),
        ("deep", boat(3, "heave")),
        ("tunnel", boat(4, kind="tunnel")),
    ):
        plain = out / f"{name}.plain.json"
        plain.write_text(json.dumps(one), encoding="utf-8")
        import_plain(plain, out / f"{name}.h5")
    (out / "boat.toml").write_text(INSTALLATION, encoding="utf-8")
    return out


def test_text_json_and_page_of_a_vehicle(folder: Path) -> None:
    known = ("--installation", folder / "boat.toml", "--axis", "surge")
    out = (folder / "found.json", folder / "found.html")
    said = run(
        "diagnose", folder / "one.h5", "--holdout", folder / "two.h5", *known, "--json", out[0], "--report", out[1]
    )
    assert said.exit_code == 0, said.output
    found = json.loads(out[0].read_text(encoding="utf-8"))
    assert found["verdict"] == "explained"
    assert [f["effect"] for f in found["findings"]] == ["linear_drag"]
    k = found["findings"][0]["parameters"]["k"]
    assert abs(k["value"] - 30) < 4 * k["std"]
    assert found["response"] == {"quantity": "speed", "unit": "m/s", "force_unit": "N"}
    assert found["fit"]["heldout"]["rmse_after"] < 0.012
    assert "RMSE per sample / m/s" in said.output
    page = out[1].read_text(encoding="utf-8")
    assert "before / m/s" in page
    assert "Motion and residual" in page


RIGHT = str(Path(__file__).parents[1] / "wrong" / "right.toml")
BAD = {
    "mass": (("one.h5", "--mass", "-3"), "--mass -3: expected a number of kg above 0"),
    "std alone": (("one.h5", "--mass-std", "1"), "--mass-std needs --mass"),
    "no such axis": (("one.h5", "--axis", "sway"), "none of the recordings drives sway"),
    "two axes": (("one.h5", "deep.h5"), "the recordings drive several axes (surge in 1; heave in 1)"),
    "with a thruster": (("one.h5", "tunnel.h5"), "is a tunnel recording, the others are of a vehicle"),
    "a thruster alone": (("tunnel.h5", "--mass", "3"), "these are recordings of a thruster"),
    "no fit": (("one.h5", "--thrusters", "absent.json"), "there is no such file"),
    "no installation": (("one.h5", "--installation", "absent.toml"), "absent.toml"),
    "a budget": (("one.h5", "--budget", "60"), "--campaign and --budget are of an experiment on the bench"),
    "a campaign": (("one.h5", "--campaign", RIGHT), "--campaign and --budget are of an experiment on the bench"),
    "a plan": (("one.h5", "--campaign", RIGHT, "--plan", "next.toml"), "--plan writes a campaign of the bench"),
    "held out too": (("one.h5", "--holdout", "two.h5", "one.h5"), "is both to be diagnosed and held out"),
    "stages": (("one.h5", "--explain"), "--explain shows the stages of a thruster's diagnosis"),
    "a twin": (("one.h5", "--save-twin", "twin.json"), "--save-twin keeps the model of a thruster"),
}


def test_files_of_one_name_in_two_folders_are_two_trials(tmp_path: Path) -> None:
    installation = tmp_path / "boat.toml"
    installation.write_text(f'{INSTALLATION}[trials."*run"]\naxis = "surge"\n')
    recordings = {Path(f"{day}/run.h5"): Recording(day, "boat", ()) for day in ("may", "june")}
    found = setup_of(VehicleFiles(installation=installation), recordings)
    assert found.axes == {"may": "surge", "june": "surge"}
    assert found.ballast == {"may": "run", "june": "june/run"}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_used_is_one_sentence_and_exit_status_2(
    name: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """None of it after a computation."""
    monkeypatch.setattr("identification.mismatch.vehicle.diagnose._diagnosed", lambda *_: pytest.fail("computed"))
    arguments, says = BAD[name]
    said = run("diagnose", *(folder / a if a.endswith((".h5", ".json", ".toml")) else a for a in arguments))
    assert said.exit_code == 2
    assert says in said.output
    assert said.output.startswith("rig diagnose: ")
    assert said.output.count("\n") == 1
