"""One concealed case: everything that is true about it, as frozen data. Nothing here is random."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim_devices.concealed.cases.knob import Scale, Shape
from sim_devices.concealed.cases.plans import Profile, held
from sim_devices.world.history import History, clock
from sim_devices.world.noise_law import NoiseLaw
from sim_devices.world.settings import Cell, Supply, Thruster, WorldSettings, make_effects
from sim_devices.world.sweep import sweep

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Concealed:
    """One effect and how much of it there is."""

    shape: Shape
    amount: float
    seen: float = 0.0
    """Strength d' as measured when the amount was found; 0: not measured."""

    @property
    def effect(self) -> str:
        return self.shape.effect

    @property
    def parameters(self) -> dict[str, Any]:
        return self.shape.parameters(self.amount)


@dataclass(frozen=True, slots=True)
class Sensor:
    """One recorded channel beside the thrust, sampled every `every` grid points from grid point `first`."""

    quantity: str
    unit: str
    every: int
    first: int
    law: NoiseLaw


@dataclass(frozen=True, eq=False, slots=True)
class Run:
    """What is done to the thruster in one recording, and where the cell's zero lies in it."""

    profile: Profile
    flow: tuple[tuple[float, float], ...]
    """(s, m/s) of changes, the first at 0."""
    tare: float
    """N, added to every reading."""
    start: float
    """s of world time at which the recording begins."""
    seed: int
    """of the noise."""
    drive: float = 1.0
    """Of the recorded command, what the motor controller of this run puts on the motor."""


@dataclass(frozen=True, slots=True)
class Amplifier:
    """What is done to a force before it is a reading: a low pass of the first order, then a mean."""

    low_pass: float = 0.0
    """s; 0: none."""
    window: float = 0.0
    """s that end with the reading; 0: none."""


@dataclass(frozen=True, eq=False, slots=True)
class Case:
    """Draw one with `draw.case`, measure it with `oracle.strength`, make its arrays with `records.rows`."""

    thruster: Thruster
    scale: Scale
    dt: float
    """s of the world's grid; thrust is sampled every `every` points from `first`."""
    every: int
    first: int
    runs: tuple[Run, ...]
    noise_kind: str
    noise: NoiseLaw
    """of the thrust."""
    sensors: tuple[Sensor, ...]
    effects: tuple[Concealed, ...] = ()
    decoys: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """World effects that move a recorded channel and leave the thrust alone."""
    fault: Mapping[str, Any] | None = None
    """A lie about a channel, of faults.fault."""
    water_temperature: float = 18.0
    """degC at the start."""
    temperature_drift: float = 0.0
    """K/s."""
    with_steps: bool = True
    """Whether the recording holds a table of steps."""
    amplifier: Amplifier = Amplifier()
    """Of the bench that records it; arrays of a case are made without one."""

    @property
    def rate(self) -> float:
        """Thrust samples per second."""
        return 1.0 / (self.dt * self.every)


def settings(case: Case, *, without: frozenset[str] = frozenset()) -> WorldSettings:
    """The world of the case, `without` some of its effects."""
    effects = {c.effect: c.parameters for c in case.effects if c.effect not in without}
    return WorldSettings(
        thrusters={"T": case.thruster},
        mounted="T",
        supply=Supply(voltage=case.scale.bus),
        effects={**case.decoys, **effects},
    )


def history(case: Case, run: Run, *, without: frozenset[str] = frozenset()) -> History:
    """The world's run on its grid, noise-free."""
    t = clock(int(run.profile.duration / case.dt), case.dt)
    times, speeds = np.array(run.flow, dtype=np.float64).T
    command = run.drive * held(run.profile.time, run.profile.volts, t)
    water = case.water_temperature + case.temperature_drift * (run.start + t)
    world = replace(settings(case, without=without), cell=Cell(zero_offset=run.tare))
    return sweep(world, case.dt, command, held(times, speeds, t), water, run.start)


def thrust_of(
    case: Case, run: Run, h: History, noise: Floats | float = 0.0, *, without: frozenset[str] = frozenset()
) -> Floats:
    """What the cell gives at its sample times: reading, zero, `noise`, then clipping if that is concealed."""
    value = h.reading[case.first :: case.every] + run.tare + noise
    for effect in make_effects(settings(case, without=without).effects):
        if effect.stage == "output":
            value = effect.over(value, h)
    return np.asarray(value)
