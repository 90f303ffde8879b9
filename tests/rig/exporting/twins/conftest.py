"""A twin with what thrusters have: dead band, unequal directions, lag, water that follows, a bent cell."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from identification.physics.term import Scale
from identification.twin import Source, Twin, TwinNoise, TwinTerm, names_of
from rig.cli import main
from rig.twin.writing import write_twin

SCALE = Scale(16.0, "V", 50.0, 300.0, 0.02)
STD = {
    "C": 5e-4, "dead_band.half_width": 0.01, "motor_lag.time_constant": 2e-3, "asymmetry.ratio": 2e-3,
    "inflow_dynamics.share": 5e-3, "inflow_dynamics.time_constant": 0.02, "load_cell_nonlinearity.coefficient": 2e-6,
}  # fmt: skip


def a_twin(*, rate: float | None = 1.9, inflow: float = 0.15) -> Twin:
    terms = (
        TwinTerm("dead_band", "shrink", {"half_width": 0.9}, SCALE),
        TwinTerm("motor_lag", "first_order", {"time_constant": 0.12}, SCALE),
        TwinTerm("asymmetry", "", {"ratio": 0.78}, SCALE),
        TwinTerm("inflow_dynamics", "", {"share": inflow, "time_constant": 0.4}, SCALE),
        TwinTerm("load_cell_nonlinearity", "quadratic", {"coefficient": 1e-4}, SCALE),
    )
    names = names_of(terms)
    covariance = tuple(tuple(STD[a] ** 2 if a == b else 0.0 for b in names) for a in names)
    return Twin(
        "T1", "command_voltage", 0.3, terms, names, covariance, TwinNoise(0.02, 0.0),
        (Source("id", "", 0.0, "T1.h5"),), 0.02, 16.0, rate, rate, created="2026-11-26T12:00:00+00:00", software="test",
    )  # fmt: skip


def by_hand(volts: np.ndarray) -> np.ndarray:
    """N of that twin at rest with itself: the equations of the thesis and of its terms, by hand."""
    n = np.sign(volts) * np.maximum(np.abs(volts) - 0.9, 0.0)
    return 0.3 * n * np.abs(n) * np.where(n < 0, 0.78, 1.0)


@pytest.fixture(scope="session")
def twin_file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("twin") / "T1.twin.json"
    write_twin(a_twin(), path)
    return path


@pytest.fixture
def exported(twin_file, tmp_path, capsys):
    """exported(word, *options): the file that `rig export` makes."""

    def export(word: str, *options: str) -> Path:
        out = tmp_path / f"made-{word}"
        assert main(["export", str(twin_file), "--to", word, "-o", str(out), *options]) == 0
        return out

    return export


def module_of(path: Path):
    """A file as Python."""
    spec = importlib.util.spec_from_loader("made", loader=None)
    module = importlib.util.module_from_spec(spec)
    exec(compile(path.read_text(), str(path), "exec"), module.__dict__)
    return module
