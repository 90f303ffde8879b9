"""rig diagnose: what it says of a recording, in words and as JSON."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from rig.diagnose.text import diagnosis_text
from tests.identification.diagnosed_runs import dead_band as dead_zone
from tests.identification.diagnosed_runs import run as small
from tests.rig.diagnose.diagnosed_files import bad, example, run

plain = example("diagnose_plain_h5py")


def test_a_dead_band_is_named_with_its_width_and_the_contract_is_kept(dead):
    _, said, _, text = dead
    assert said["format"] == "thruster-rig-diagnosis"
    assert said["version"] == 1
    effects = {f["effect"]: f for f in said["findings"]}
    assert "dead_band" in effects or "dead_band" in {r for f in said["findings"] for r in f["rivals"]}
    if "dead_band" in effects:
        width = effects["dead_band"]["parameters"]["half_width"]
        assert abs(width["value"] - 1.5) < 5 * width["std"] + 0.02
    assert said["fit"]["heldout"]["rmse_after"] < 0.7 * said["fit"]["heldout"]["rmse_before"]
    assert {"channel", "where", "share", "p_value", "statement"} <= set(said["mismatch"][0])
    assert max(map(len, text.splitlines())) <= 100


@pytest.fixture(scope="module")
def short(folder):
    """A minute of levels with a dead band of 1.5 V."""
    channels = small(volts=dead_zone(1.5), seconds=60.0, rate=10.0).channels
    plain.write(folder / "short.h5", *(array for c in channels for array in (c.time, c.value)))
    return folder / "short.h5"


def test_explained_the_answer_is_followed_by_every_stage(short):
    result = run("diagnose", short, "--explain")
    assert result.exit_code == 0, result.output
    answer, told = result.output.split("How it came to that")
    assert answer.startswith("somebody's: explained.")
    for stage in ("prepare", "faults", "select", "periodic", "locate", "name", "validate", "unnamed", "answer"):
        assert f". {stage}: " in told
    assert max(map(len, result.output.splitlines())) <= 100


def test_explained_beside_json_standard_output_is_the_json_alone(short):
    result = run("diagnose", short, "--explain", "--json", "-")
    assert json.loads(result.stdout)["verdict"] == "explained"
    assert "1. prepare: " in result.stderr


def test_nan_blocks_are_gaps(tmp_path):
    result = run("diagnose", bad.recording(tmp_path / "gaps.h5", change=bad.nan_blocks), "--json", "-")
    assert json.loads(result.output)["verdict"] == "adequate"


def test_a_file_by_plain_h5py_is_diagnosed(tmp_path):
    found = plain.diagnosed(tmp_path, 25.0, 1.5, 0.0)
    (finding,) = found.findings
    assert finding.effect == "dead_band"
    assert abs(finding.parameters["half_width"].value - 1.5) < 0.05
    shaped = replace(found, notes=("A note.",))
    assert "- A note." in diagnosis_text(shaped)
    worse = replace(shaped, heldout=replace(shaped.heldout, before=1.0, after=1.1))
    assert "GROWS" in diagnosis_text(worse)
    assert "GROWS" not in diagnosis_text(replace(worse, heldout=replace(worse.heldout, after=1.0)))
