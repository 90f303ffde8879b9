"""Recordings as the world writes them for the proof (npz: plain arrays), as identification takes them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from identification.recording import Channel, Floats, Recording, Step


def recordings(folder: Path) -> list[Recording]:
    """Those of one case, in order: 0.npz, 1.npz ..."""
    return [recording(path) for path in sorted(folder.glob("[0-9]*.npz"), key=lambda path: int(path.stem))]


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
