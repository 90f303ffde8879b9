"""Recordings on disc with their diagnoses, made once."""

from __future__ import annotations

import json

import pytest

from tests.rig.diagnose.diagnosed_files import bad, dead_band, run


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("diagnose")


@pytest.fixture(scope="session")
def dead(folder):
    """A recording with a dead band, its diagnosis as JSON, its twin."""
    path, out, twin = (
        bad.recording(folder / "dead.h5", change=dead_band),
        folder / "dead.json",
        folder / "dead.twin.json",
    )
    result = run("diagnose", path, "--json", out, "--save-twin", twin)
    assert result.exit_code == 0, result.output
    return path, json.loads(out.read_text()), twin, result.output
