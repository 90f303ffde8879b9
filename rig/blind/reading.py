"""Recordings of a case as identification takes them: plain arrays of the world (npz), or files of the rig (HDF5)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

import numpy as np

from identification.recording import Channel, Floats, Recording, Step
from rig.hdf5.load import load

AGAIN: Final = "again"
"""Folder within a case's own: the same thruster a second time, and the drive that is to be predicted then."""


def recordings(folder: Path) -> list[Recording]:
    """Those of one case, in order: 0.npz, 1.npz ..., or 0.h5 where it was recorded on a bench."""
    found = sorted((*folder.glob("[0-9]*.npz"), *folder.glob("[0-9]*.h5")), key=lambda path: int(path.stem))
    return [load(path) if path.suffix == ".h5" else recording(path) for path in found]


def recording(path: Path) -> Recording:
    """One of them. Raises OSError, KeyError and ValueError for a file that is none."""
    with np.load(path) as found:
        about = json.loads(str(found["about"]))
        channels = tuple(
            Channel(
                name=column["name"],
                stream=column["stream"],
                quantity=column["quantity"],
                unit=column["unit"],
                time=found[f"time{i}"],
                value=found[f"value{i}"],
                thruster=column["thruster"] or None,
            )
            for i, column in enumerate(about["columns"])
        )
    steps = tuple(Step(i, s["phase"], s["volts"], s["start"], s["end"]) for i, s in enumerate(about["steps"]))
    return Recording(about["recording_id"], about["thruster"], channels, steps, outcome="completed", source=path.name)


def times(path: Path) -> Floats:
    """At which a drive's thrust is to be predicted, (n,) s."""
    with np.load(path) as found:
        return np.array(found["at"], dtype=np.float64)
