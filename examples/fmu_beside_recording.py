"""An FMU of a twin in another program, FMPy, driven by a recording's command, beside the thrust that was recorded.

    rig diagnose T1.h5 --save-twin T1.twin.json
    rig export T1.twin.json --to fmu
    pip install fmpy
    python examples/fmu_beside_recording.py T1.fmu T1.h5

Printed: the rms of recorded minus simulated thrust at the recorded samples, with the run's zero taken out, beside what
C V|V| alone leaves.
"""

from __future__ import annotations

import sys
from pathlib import Path

import fmpy
import numpy as np

from rig.hdf5 import load

COASTS = 2.0
"""s after that in which the rotor still turns by itself."""
STEP = 0.002
"""s between two communication points."""


def main(fmu: str, path: str) -> None:
    recording = load(Path(path))
    command, thrust = recording.first_of("command_voltage"), recording.first_of("thrust")
    assert command is not None
    assert thrust is not None
    known = np.isfinite(command.value)
    rows = [(-1.0, 0.0), *zip(command.time[known], command.value[known], strict=True)]
    drive = np.array(rows, dtype=[("time", "f8"), ("input", "f8")])
    found = fmpy.simulate_fmu(
        fmu, input=held(drive), start_time=0.0, stop_time=float(thrust.time[-1]), output_interval=STEP
    )
    simulated = np.interp(thrust.time, found["time"], found["thrust"])
    volts = command.value[np.clip(np.searchsorted(command.time, thrust.time, "right") - 1, 0, None)]
    driven = np.isfinite(volts) & np.isfinite(thrust.value)  # not while the watchdog is proved, when nobody commands
    free = np.maximum.accumulate(np.where(driven, -np.inf, thrust.time))
    driven &= thrust.time > free + COASTS
    shape = (volts * np.abs(volts))[driven]
    C = float(shape @ thrust.value[driven] / (shape @ shape))
    print(f"{path}: {thrust.time.size} samples over {thrust.time[-1]:.0f} s")
    print(f"the FMU in FMPy: {rms((thrust.value - simulated)[driven]):.3f} N rms from what was recorded")
    print(f"C V|V| alone:    {rms(thrust.value[driven] - C * shape):.3f} N rms")


def held(drive: np.ndarray) -> np.ndarray:
    """A command holds until its next row; FMPy would draw a straight line."""
    before = drive[:-1].copy()
    before["time"] = np.maximum(drive["time"][1:] - 1e-6, drive["time"][:-1] + 1e-9)
    return np.sort(np.concatenate([drive, before]), order="time")


def rms(error: np.ndarray) -> float:
    """Without the run's zero."""
    return float(np.std(error))


if __name__ == "__main__":
    main(*sys.argv[1:])
