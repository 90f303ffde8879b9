"""Recordings that this project did not make: ten lines of plain h5py after the recording format, diagnosed rightly.

    python examples/diagnose_plain_h5py.py

Volts within +-48 V, sampled at 25 Hz and at 500 Hz, no bus voltage, temperature, flow or /steps. Two dead bands and a
motor lag are put in by hand; nothing of `sim_devices` is used.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import h5py
import numpy as np

from identification.mismatch.diagnosis import Diagnosis
from rig.diagnose.command import diagnose_files
from rig.diagnose.text import diagnosis_text


def write(path: Path, start: np.ndarray, level: np.ndarray, time: np.ndarray, thrust: np.ndarray) -> None:
    """The ten lines."""
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "thruster-rig-recording"
        file.attrs["format_version"] = 1
        file.attrs["recording_id"] = path.stem
        file.attrs["thruster"] = "somebody's"
        for stream, t, value, quantity, unit in (
            ("drive", start, level, "command_voltage", "V"),
            ("cell", time, thrust, "thrust", "N"),
        ):
            file[f"streams/{stream}/time"] = t
            file[f"streams/{stream}/x"] = value
            file[f"streams/{stream}/x"].attrs.update({"quantity": quantity, "unit": unit})


def run(rate: float, dead: float, lag: float, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Six minutes of random levels of 3 s: C = 0.05 N/V^2, a `dead` band (V) and a first-order `lag` (s), noise."""
    rng = np.random.default_rng(seed)
    start = np.arange(0.0, 360.0, 3.0)
    level = rng.permutation(np.round(np.linspace(-48.0, 48.0, start.size), 2))
    level[0] = 0.0  # as every run, it begins at rest
    step = 0.001
    fine = np.arange(0.0, 360.0, step)
    acting = level[np.searchsorted(start, fine, side="right") - 1]
    acting = np.sign(acting) * np.maximum(np.abs(acting) - dead, 0.0)
    rate_of_rotor, x, keep = np.empty(fine.size), 0.0, np.exp(-step / lag) if lag else 0.0
    for i, target in enumerate(acting.tolist()):
        rate_of_rotor[i] = x if lag else target
        x = target + (x - target) * keep
    at = np.arange(0, fine.size, round(1 / rate / step))
    exact = 0.05 * rate_of_rotor[at] * np.abs(rate_of_rotor[at])
    return start, level, fine[at], exact - 1.3 + 0.4 * rng.standard_normal(at.size)


def diagnosed(folder: Path, rate: float, dead: float, lag: float, seed: int = 1) -> Diagnosis:
    path = folder / f"at_{rate:g}_Hz.h5"
    write(path, *run(rate, dead, lag, seed))
    return diagnose_files([path])


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        for rate, dead, lag in ((25.0, 1.5, 0.0), (500.0, 2.5, 0.08), (25.0, 0.0, 0.0)):
            print(f"--- {rate:g} Hz; concealed: dead band {dead:g} V, motor lag {1000 * lag:g} ms")
            print(diagnosis_text(diagnosed(Path(name), rate, dead, lag)), end="\n\n")


if __name__ == "__main__":
    main()
