"""Trials of the simulated vehicle: constant commands, sines, up and down with ballast; what was recorded of them.

A record is plain data named as the recording format names it; whoever may write files makes recordings of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import cos, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from sim_devices.vehicle.body import AXES, Hull

Floats = NDArray[np.float64]

STEP = 0.05
"""s of the simulation: the fastest vehicle here has a time constant above 0.5 s."""
COMMAND_RATE = 20.0
"""1/s at which a sine is commanded; the simulation's own step, so that held commands are exact."""
FIX_RATE = 3.0
"""1/s of the acoustic positioning (section 4.2.3)."""
DEPTH_RATE = 10.0
"""1/s of the depth-meter (section 4.2.4)."""
GYRO_RATE = 10.0


@dataclass(frozen=True, slots=True)
class Hold:
    """Constant volts of each thruster for `run_up` s to gather way and then `length` s."""

    volts: Mapping[str, float]
    length: float
    run_up: float = 0.0


@dataclass(frozen=True, slots=True)
class Sine:
    """Thrusters at sqrt(|f|) sign(f) x volts, f = offset + amplitude sin(2 pi t / period): the *force* is the sine."""

    volts: Mapping[str, float]
    offset: float
    amplitude: float
    period: float
    """s"""
    length: float


@dataclass(frozen=True, slots=True)
class Trial:
    """One recording: parts in order, the vehicle moving along one axis at one heading."""

    name: str
    axis: str
    parts: Sequence[Hold | Sine]
    heading: float = 0.0
    """rad."""
    ballast: float = 0.0
    """N downwards, heave only."""

    def __post_init__(self) -> None:
        if self.axis not in AXES or not self.parts:
            raise ValueError(f"Trial {self.name}: needs one of {', '.join(AXES)} and at least one part")

    @property
    def duration(self) -> float:
        return sum(p.length + (p.run_up if isinstance(p, Hold) else 0.0) for p in self.parts)


@dataclass(frozen=True, slots=True)
class RecordedChannel:
    """One channel with the attributes of the recording format."""

    name: str
    stream: str
    quantity: str
    unit: str
    time: Floats
    value: Floats
    axis: str | None = None
    thruster: str | None = None
    noise_std: float | None = None


@dataclass(frozen=True, slots=True)
class RecordedStep:
    """One step of a trial as it was run; times in s."""

    index: int
    phase: str
    command_voltage: float
    """V, largest of the thrusters."""
    t_start: float
    t_end: float


@dataclass(frozen=True, slots=True)
class Record:
    """What was recorded of one trial, and apart from it the truth."""

    name: str
    vehicle: str
    axis: str
    channels: tuple[RecordedChannel, ...]
    steps: tuple[RecordedStep, ...]
    truth: Mapping[str, Floats] = field(default_factory=dict)
    """`time`, `velocity` (over ground) and `position` at every simulation step."""


def _commands(trial: Trial) -> tuple[Floats, list[dict[str, float]], list[RecordedStep]]:
    """Rows of changes (time, volts of each thruster) and the table of steps."""
    times: list[float] = []
    rows: list[dict[str, float]] = []
    steps: list[RecordedStep] = []
    at = 0.0
    for part in trial.parts:
        top = max((abs(v) for v in part.volts.values()), default=0.0)
        if isinstance(part, Hold):
            times.append(at)
            rows.append(dict(part.volts))
            if part.run_up > 0:
                steps.append(RecordedStep(len(steps), "ramp", top, at, at + part.run_up))
            at += part.run_up
            steps.append(RecordedStep(len(steps), "hold", top, at, at + part.length))
        else:
            for i in range(round(part.length * COMMAND_RATE)):
                t = i / COMMAND_RATE
                f = part.offset + part.amplitude * sin(2 * pi * t / part.period)
                times.append(at + t)
                rows.append({name: V * sqrt(abs(f)) * (1 if f >= 0 else -1) for name, V in part.volts.items()})
            steps.append(RecordedStep(len(steps), "sine", top, at, at + part.length))
        at += part.length
    return np.array(times), rows, steps


def _forces(hull: Hull, trial: Trial, times: Floats, rows: list[dict[str, float]], rng: np.random.Generator) -> Floats:
    """N (N.m) on the trial's axis in every simulation step."""
    steps = round(trial.duration / STEP)
    index = np.searchsorted(times, (np.arange(steps) + 0.5) * STEP, side="right") - 1
    weight = hull.buoyancy + trial.ballast if trial.axis == "heave" else 0.0
    if hull.motor_lag:
        turned = _lagged(hull, rows, index)
        return np.array([hull.force(trial.axis, row) for row in turned]) + weight
    own = np.array([hull.force(trial.axis, row) for row in rows])
    if hull.wander and len(trial.parts) == len(rows):
        own = own + hull.wander * rng.standard_normal(own.size)
    out: Floats = own[index] + weight
    return out


def _lagged(hull: Hull, rows: list[dict[str, float]], index: NDArray[np.intp]) -> list[dict[str, float]]:
    """Volts that each thruster's rate stands for, in the middle of every step; all begin at rest."""
    names = list(hull.thrusters)
    asked = np.array([[row.get(name, 0.0) for name in names] for row in rows])[index]
    keep = float(np.exp(-STEP / hull.motor_lag))
    halfway = float(np.exp(-0.5 * STEP / hull.motor_lag))
    x, out = np.zeros(len(names)), []
    for V in asked:
        out.append(dict(zip(names, (V + (x - V) * halfway).tolist(), strict=True)))
        x = V + (x - V) * keep
    return out


def _current(hull: Hull, trial: Trial) -> float:
    """m/s along the trial's axis."""
    north, east = hull.current
    match trial.axis:
        case "surge":
            return north * cos(trial.heading) + east * sin(trial.heading)
        case "sway":
            return east * cos(trial.heading) - north * sin(trial.heading)
        case _:
            return 0.0


def _move(hull: Hull, trials: Sequence[Trial], forces: Sequence[Floats]) -> list[tuple[Floats, Floats]]:
    """Velocity over ground and position of every trial from rest over ground, all trials in one sweep (Heun's rule)."""
    bodies = [hull.axes[trial.axis] for trial in trials]
    m, a, b, back = (np.array([getattr(x, f) for x in bodies]) for f in ("inertia", "linear", "quadratic", "astern"))
    stream = np.array([_current(hull, trial) for trial in trials])
    steps = max(f.size for f in forces)
    push = np.zeros((steps, len(trials)))
    for j, force in enumerate(forces):
        push[: force.size, j] = force
    v, x = -stream.copy(), np.zeros(len(trials))
    speeds, places = [v + stream], [x]
    halves = 2
    h = STEP / halves

    def slope(p: Floats, v: Floats, x: Floats) -> Floats:
        square = b * np.where(v < 0, back, 1.0) + hull.tether * np.abs(x)
        out: Floats = (p - (a + square * np.abs(v)) * v) / m
        return out

    for p in push:
        for _ in range(halves):
            first = slope(p, v, x)
            guess = v + h * first
            later = v + 0.5 * h * (first + slope(p, guess, x + h * (v + stream)))
            x = x + h * (0.5 * (v + later) + stream) - h * h / 12 * (slope(p, later, x) - first)
            v = later
        speeds.append(v + stream)
        places.append(x)
    fast, far = np.array(speeds), np.array(places)
    return [(fast[: f.size + 1, j], far[: f.size + 1, j]) for j, f in enumerate(forces)]


def _sampled(grid: Floats, truth: Floats, rate: float, noise: float, rng: np.random.Generator) -> tuple[Floats, Floats]:
    time = np.arange(int(grid[-1] * rate) + 1) / rate
    return time, np.interp(time, grid, truth) + noise * rng.standard_normal(time.size)


def _channels(hull: Hull, trial: Trial, grid: Floats, place: Floats, rng: np.random.Generator) -> list[RecordedChannel]:
    """The moving axis and the heading, as measured."""
    noise = hull.noise
    turning = trial.axis == "yaw"
    heading = trial.heading + (place if turning else np.zeros(grid.size))
    t, psi = _sampled(grid, heading, GYRO_RATE, noise["heading"], rng)
    out = [RecordedChannel("heading", "gyro", "heading", "rad", t, psi, "yaw", noise_std=noise["heading"])]
    if trial.axis == "heave":
        t, z = _sampled(grid, place, DEPTH_RATE, noise["depth"], rng)
        out.append(RecordedChannel("depth", "depth_meter", "depth", "m", t, z, "heave", noise_std=noise["depth"]))
    elif not turning:
        t, x = _sampled(grid, place, FIX_RATE, noise["position"], rng)
        name = noise["position"]
        out.append(RecordedChannel(trial.axis, "acoustic", "position", "m", t, x, trial.axis, noise_std=name))
    return out


def run_trials(hull: Hull, trials: Sequence[Trial], rng: np.random.Generator) -> tuple[Record, ...]:
    """Run every trial from rest and record it."""
    planned = [_commands(trial) for trial in trials]
    forces = [_forces(hull, t, times, rows, rng) for t, (times, rows, _) in zip(trials, planned, strict=True)]
    out = []
    moves = _move(hull, trials, forces)
    for trial, (times, rows, steps), (speed, place) in zip(trials, planned, moves, strict=True):
        grid: Floats = np.arange(place.size, dtype=np.float64) * STEP
        commands = [
            RecordedChannel(
                f"command_{name}", "command", "command_voltage", "V", times,
                np.array([row.get(name, 0.0) for row in rows]), thruster=name,
            )
            for name in hull.thrusters
        ]  # fmt: skip
        channels = (*commands, *_channels(hull, trial, grid, place, rng))
        truth = {"time": grid, "velocity": speed, "position": place}
        out.append(Record(trial.name, hull.name, trial.axis, channels, tuple(steps), truth))
    return tuple(out)
