"""Recordings of a few hundred rows, as a line's end makes them; how they differ is said."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from rig.hdf5 import RecordingFile
from rig.link.recorder_messages import ChannelSpec, Rows, StepRow, StreamSpec

LEVELS = (0.0, 4.0, -4.0, 8.0, -8.0, 12.0, -12.0, 0.0)
DWELL, RATE = 1.0, 50
STREAMS = [
    StreamSpec(
        "cell", "x", (ChannelSpec("thrust", "thrust", "N", calibration=json.dumps({"gain_std": 0.002, "date": "a"})),)
    ),
    StreamSpec("command", "command", (ChannelSpec("command_voltage", "command_voltage", "V"),)),
]


def write(path: Path, number: int, C: float = 0.4, created: str = "2026-11-26T10:00:00+00:00") -> Path:
    """A staircase of thruster `T-<number>`: thrust = C V|V| + 0.3 N and white noise of 0.05 N."""
    named = {"recording_id": f"id-{number}", "created": created, "thruster": f"T-{number:05}", "kind": "tunnel"}
    file = RecordingFile(path, named, STREAMS, 0)
    time = np.arange(0.0, DWELL * len(LEVELS), 1.0 / RATE)
    V = np.repeat(LEVELS, round(DWELL * RATE))
    thrust = C * V * np.abs(V) + 0.3 + np.random.default_rng(number).normal(0.0, 0.05, time.size)
    file.add_rows(Rows(0, np.rint(time * 1e9).astype(np.int64), thrust[:, None]))
    starts = np.arange(len(LEVELS)) * DWELL
    file.add_rows(Rows(1, np.rint(starts * 1e9).astype(np.int64), np.array(LEVELS)[:, None]))
    for index, (level, start) in enumerate(zip(LEVELS, starts.tolist(), strict=True)):
        file.add_step(StepRow(index, "hold" if level else "tare", level, start, start + DWELL))
    file.close("completed", "", DWELL * len(LEVELS))
    return path


def folder(root: Path, count: int) -> Path:
    """So many recordings of thrusters of their own."""
    root.mkdir(exist_ok=True)
    for number in range(count):
        write(root / f"{number}.h5", number)
    return root
