"""A production: thrusters that differ as a maker's do, some of which hide something, some of which came from one batch.

It is written by hand from the equations and shares nothing with the simulated world or the identification. All units
have a dead band, a loss in reverse and a motor lag; C spreads by 1 % from unit to unit. The cell was calibrated eight
times, each with an error of 0.2 % that all units after it share.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rig.hdf5 import RecordingFile
from rig.link.recorder_messages import ChannelSpec, Rows, StepRow, StreamSpec

C, SPREAD, DEAD_BAND, REVERSE, LAG, TARE, NOISE = 0.4, 0.01, 0.3, 0.93, 0.08, 0.3, 0.05
"""N/V^2, share, V, share of the forward thrust, s, N, N."""
RATE, DWELL = 50, 1.0
"""1/s, s of a level."""
LEVELS = (0.0, 4.0, -4.0, 10.0, -10.0, 7.0, -7.0, 12.0, -12.0, 2.0, -2.0, 5.0, -5.0, 11.0, -11.0, 8.0, -8.0, 0.0)
SHORT = (0.0, 4.0, -4.0, 8.0, -8.0, 12.0, -12.0, 0.0)
CALIBRATIONS, GAIN_STD = 8, 0.002
BATCH = -0.025
"""By how much C of a batch has fallen at its end."""
HIDDEN = ("dead_band", "asymmetry", "winding", "cell_bend", "lag", "reversal", "ceiling")


@dataclass(frozen=True)
class Unit:
    """One thruster on the line."""

    number: int
    C: float
    gain: float
    """Of the cell, as its calibration leaves it."""
    calibration: str
    hides: str = ""
    seed: int = 0


@dataclass(frozen=True)
class Production:
    """`odd`: what the units of these numbers hide; `batch`: first and last number of the one that drifts."""

    units: tuple[Unit, ...]
    odd: dict[int, str] = field(default_factory=dict)
    batch: tuple[int, int] = (0, -1)


def production(count: int, seed: int, *, sound: bool = False) -> Production:
    """So many units; `sound`: nothing is hidden and no batch drifts."""
    rng = np.random.default_rng(seed)
    gains = 1.0 + GAIN_STD * rng.standard_normal(CALIBRATIONS)
    constants = C * (1.0 + SPREAD * rng.standard_normal(count))
    first = int(rng.integers(count // 4, count // 2))
    last = first + max(count // 13, 1) - 1
    free = [k for k in range(count) if not first - 20 <= k <= last + 20]
    odd = {} if sound else dict(zip(rng.choice(free, len(HIDDEN), replace=False).tolist(), HIDDEN, strict=True))
    if not sound:
        constants[first : last + 1] *= 1.0 + BATCH * np.linspace(0.0, 1.0, last + 1 - first) ** 0.5
    units = tuple(
        Unit(
            k,
            float(constants[k]),
            float(gains[k * CALIBRATIONS // count]),
            f"2026-{1 + k * CALIBRATIONS // count:02}-01",
            odd.get(k, ""),
            seed * 1_000_003 + k,
        )
        for k in range(count)
    )
    return Production(units, odd, (0, -1) if sound else (first, last))


def thrust_of(unit: Unit, time: np.ndarray, command: np.ndarray) -> np.ndarray:
    """(n,) N, as the cell reads it: the command, held from its row on, turns the rotor after what is lost of it."""
    V = np.minimum(command, 10.5) if unit.hides == "ceiling" else command
    half = DEAD_BAND * (3.0 if unit.hides == "dead_band" else 1.0)
    wanted = np.sign(V) * np.maximum(np.abs(V) - half, 0.0)
    if unit.hides == "winding":
        wanted /= 0.5 + np.sqrt(0.25 + 0.008 * np.abs(wanted))
    lag = LAG * (2.0 if unit.hides == "lag" else 1.0)
    speed, state, keep = np.empty(V.size), 0.0, float(np.exp(-1.0 / (RATE * lag)))
    for k, goal in enumerate(wanted.tolist()):
        speed[k] = state
        state = goal + (state - goal) * keep
    force = unit.C * speed * np.abs(speed)
    force *= np.where(force < 0.0, REVERSE * (0.93 if unit.hides == "asymmetry" else 1.0), 1.0)
    if unit.hides == "reversal":
        turned = np.concatenate(([False], np.sign(V[1:]) * np.sign(V[:-1]) < 0))
        since = time - np.maximum.accumulate(np.where(turned, time, -1e9))
        force *= 1.0 - 0.15 * np.exp(-since / 0.4)
    if unit.hides == "cell_bend":
        force += 0.0008 * force * np.abs(force)
    noise = np.random.default_rng(unit.seed).normal(0.0, NOISE, time.size)
    return np.asarray(unit.gain * force + TARE + noise)


def write(unit: Unit, path: Path, levels: tuple[float, ...] = LEVELS, day: str = "") -> None:
    """Its recording: a staircase in the order that a line's end has it."""
    made = day or f"2026-{1 + unit.number // 200 % 12:02}-{1 + unit.number // 10 % 20:02}"
    about = {
        "recording_id": f"eol-{unit.number}",
        "created": f"{made}T08:{unit.number % 60:02}:00+00:00",
        "thruster": f"T200-{unit.number:05}",
        "kind": "tunnel",
    }
    note = json.dumps({"gain_std": GAIN_STD, "date": unit.calibration})
    streams = [
        StreamSpec("cell", "cell", (ChannelSpec("thrust", "thrust", "N", calibration=note),)),
        StreamSpec("command", "command", (ChannelSpec("command_voltage", "command_voltage", "V"),)),
    ]
    file = RecordingFile(path, about, streams, 0)
    time = np.arange(0.0, DWELL * len(levels), 1.0 / RATE)
    command = np.repeat(levels, round(DWELL * RATE))
    file.add_rows(Rows(0, np.rint(time * 1e9).astype(np.int64), thrust_of(unit, time, command)[:, None]))
    starts = np.arange(len(levels)) * DWELL
    file.add_rows(Rows(1, np.rint(starts * 1e9).astype(np.int64), np.array(levels)[:, None]))
    for k, (level, start) in enumerate(zip(levels, starts.tolist(), strict=True)):
        file.add_step(StepRow(k, "hold" if level else "tare", level, start, start + DWELL))
    file.close("completed", "", DWELL * len(levels))
