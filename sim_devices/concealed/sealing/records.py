"""What the instruments wrote down: plain arrays of each recording of a case, and the truth beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any
from uuid import UUID

import numpy as np
from numpy.typing import NDArray

from sim_devices.concealed.cases.definition import Case, Run, Sensor, history, settings, thrust_of
from sim_devices.concealed.cases.faults import Column, lying
from sim_devices.concealed.cases.plans import Step
from sim_devices.concealed.cases.wiring import miswired
from sim_devices.concealed.visibility.oracle import strength
from sim_devices.world.history import History, clock
from sim_devices.world.noise_law import drawn, rounded

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False, slots=True)
class Rows:
    """One recording."""

    recording_id: str
    thruster: str
    columns: tuple[Column, ...]
    steps: tuple[Step, ...]
    duration: float
    """s."""


def rows(case: Case, thruster: str = "T") -> list[Rows]:
    """The recordings of a case, noise in them. The same case gives the same arrays."""
    return [_one(case, run, thruster) for run in case.runs]


def recording_id(run: Run) -> str:
    """A UUID that follows from the seed and gives away nothing of the case."""
    return str(UUID(bytes=np.random.default_rng([run.seed, 1]).bytes(16), version=4))


def _one(case: Case, run: Run, thruster: str) -> Rows:
    rng = np.random.default_rng(run.seed)
    h = history(case, run)
    noise = drawn(case.noise, h.reading[case.first :: case.every], case.rate, rng)
    read = rounded(case.noise, thrust_of(case, run, h, noise))
    seconds = clock(h.t.size, case.dt)
    columns = [
        Column("command", "command_voltage", "command_voltage", "V", run.profile.time, run.profile.volts),
        Column("cell", "thrust", "thrust", "N", seconds[case.first :: case.every], read),
        *(_sensed(case, sensor, h, seconds, rng) for sensor in case.sensors),
        *_neighbour(case, run),
    ]
    columns = list(_told(columns, case, run))
    steps = run.profile.steps if case.with_steps else ()
    return Rows(recording_id(run), thruster, tuple(columns), steps, run.profile.duration)


def _told(columns: list[Column], case: Case, run: Run) -> Sequence[Column]:
    """With the lie in them: about all runs, or about one of them where it says so."""
    if case.fault is None:
        return columns
    if "run" in case.fault:
        return miswired(columns, case.fault) if run is case.runs[case.fault["run"]] else columns
    return lying(columns, case.fault, run.start)


def _sensed(case: Case, sensor: Sensor, h: History, seconds: Floats, rng: np.random.Generator) -> Column:
    at = slice(sensor.first, None, sensor.every)
    exact = {
        "rotation_rate": h.n,
        "current": h.current,
        "bus_voltage": h.bus_voltage,
        "motor_temperature": h.water_temperature + h.motor_rise,
        "flow_speed": h.flow,
        "water_temperature": h.water_temperature,
    }[sensor.quantity][at]
    value = exact + drawn(sensor.law, exact, 1.0 / (case.dt * sensor.every), rng)
    return Column(sensor.quantity, sensor.quantity, sensor.quantity, sensor.unit, seconds[at], value)


def _neighbour(case: Case, run: Run) -> list[Column]:
    """The command of the other thruster, where there is one."""
    p = settings(case).effects.get("thruster_interaction")
    if p is None:
        return []
    switches = np.arange(0.0, run.start + run.profile.duration, p["period"])
    on, off = switches + p["period"] - p["on_time"], switches
    time = np.concatenate([off, on]) - run.start
    volts = np.concatenate([np.zeros(off.size), np.full(on.size, round(case.scale.voltage, 1))])
    order = np.argsort(time, kind="stable")
    time, volts = time[order], volts[order]
    inside = (time >= 0.0) & (time < run.profile.duration)
    began = volts[np.flatnonzero(time <= 0.0)[-1]]
    time, volts = np.append(0.0, time[inside & (time > 0.0)]), np.append(began, volts[inside & (time > 0.0)])
    return [Column("neighbour", "command_voltage", "command_voltage", "V", time, volts, thruster="neighbour")]


def truth(case: Case) -> dict[str, Any]:
    """Everything that was concealed, in SI, ready for JSON: for a sealed file, never for the diagnosis."""
    return {
        "effects": [
            {
                "effect": c.effect,
                "parameters": c.parameters,
                "amount": c.amount,
                "d_prime": c.seen or strength(case, c.effect),
            }
            for c in case.effects
        ],
        "baseline": {"C": case.thruster.C},
        "scale": asdict(case.scale),
        "noise_kind": case.noise_kind,
        "noise": asdict(case.noise),
        "plan": [run.profile.kind for run in case.runs],
        "rate": case.rate,
        "channels": [sensor.quantity for sensor in case.sensors],
        "decoys": {name: dict(p) for name, p in case.decoys.items()},
        "fault": None if case.fault is None else dict(case.fault),
        "tare": [run.tare for run in case.runs],
        "recordings": [recording_id(run) for run in case.runs],
    }
