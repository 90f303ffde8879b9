"""rig compare: what a simulation leaves out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from rig.hdf5 import load
from rig.twin.reading import read_twin
from tests.rig.diagnose.diagnosed_files import bad, dead_band, run
from tests.rig.report_reading import open_fonts

RIGHT = Path(__file__).parents[1] / "wrong" / "right.toml"


def noiseless(columns: dict) -> None:
    start, level, *_ = columns["command"]
    time, _, *rest = columns["cell"]
    volts = level[np.searchsorted(start, time, side="right") - 1]
    columns["cell"] = (time, 0.4 * volts * np.abs(volts), *rest)


@pytest.fixture(scope="module")
def simulation(folder):
    open_fonts()
    return bad.recording(folder / "foreign.h5", "model 7", change=noiseless)


def test_compare_names_what_the_simulation_leaves_out(simulation, dead):
    result = run("compare", simulation, dead[0], "--json", "-")
    assert result.exit_code == 0, result.output
    said = json.loads(result.output)
    named = {f["effect"] for f in said["findings"]} | {r for f in said["findings"] for r in f["rivals"]}
    assert "dead_band" in named
    assert "the simulation foreign.h5" in said["baseline"]["model"]


def test_compare_writes_and_holds_out_as_diagnose_does(simulation, dead, folder, tmp_path):
    kept = bad.recording(folder / "kept.h5", seed=3, change=dead_band)
    out = {name: tmp_path / name for name in ("found.json", "found.html", "T1.twin.json", "next.toml")}
    options = ("--json", out["found.json"], "--report", out["found.html"], "--save-twin", out["T1.twin.json"])
    bench = ("--plan", out["next.toml"], "--campaign", RIGHT, "--budget", 60)
    result = run("compare", simulation, dead[0], "--holdout", kept, *options, *bench)
    assert result.exit_code == 0, result.output
    said = json.loads(out["found.json"].read_text())
    assert load(kept).recording_id in said["fit"]["heldout"]["what"]
    assert said["fit"]["heldout"]["rmse_after"] < 0.7 * said["fit"]["heldout"]["rmse_before"]
    assert out["next.toml"].exists() == (said["next_experiment"] is not None)
    assert ("no next experiment is needed" in result.stderr) == (said["next_experiment"] is None)
    assert "the simulation foreign.h5" in out["found.html"].read_text()
    twin = read_twin(out["T1.twin.json"])
    assert {s.recording_id for s in twin.sources} == {load(path).recording_id for path in (simulation, dead[0])}
    assert all(len(s.sha256) == 64 for s in twin.sources)
    again = run("diagnose", dead[0], "--twin", out["T1.twin.json"], "--json", "-")
    assert json.loads(again.output)["verdict"] == "adequate"


def test_compare_draws_each_effect_by_itself(simulation, dead):
    from identification.mismatch.compare.reported_runs import runs_of
    from rig.diagnose.compare import compare_files

    found = compare_files(simulation, dead[0])
    (one,) = runs_of(found.real, [found.recording])
    assert {(f.effect, f.form) for f in found.real.findings} <= set(one.effects)


def test_compare_holds_out_neither_of_the_two(simulation, dead):
    for one in (simulation, dead[0]):
        result = run("compare", simulation, dead[0], "--holdout", one)
        assert result.exit_code == 2
        assert "is both to be diagnosed and held out" in result.output


def test_compare_refuses_another_command(folder, dead):
    def slower(columns: dict) -> None:
        start, level, *rest = columns["command"]
        columns["command"] = (start, level[::-1].copy(), *rest)

    result = run("compare", bad.recording(folder / "slower.h5", change=slower), dead[0])
    assert result.exit_code == 2
    assert "was not driven as dead.h5 was: at" in result.output
