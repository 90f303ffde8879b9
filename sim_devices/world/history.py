"""A whole run at once: the fields of `State` as arrays over a uniform time grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_devices.world.state import State

Floats = NDArray[np.float64]


@dataclass(slots=True)
class History:
    """Arrays (n,) of one run, SI, rotation in rev/s; filled stage by stage, so an effect sees what came before it."""

    t: Floats
    dt: float
    """s between grid points."""
    command: Floats
    flow: Floats
    water_temperature: Floats
    volts: Floats
    n: Floats
    acceleration: Floats
    thrust: Floats
    force: Floats
    reading: Floats
    current: Floats
    input_current: Floats
    bus_voltage: Floats
    motor_rise: Floats
    terminals: Floats
    flux: Floats
    rate_per_volt: float = 1.0
    thrust_constant: float = 0.4
    drag: float = 0.25
    torque_acceleration: float = 7.2
    nominal_bus: float = 48.0
    series_loss: float = 0.0
    stand_frequency: float = 0.0
    stand_damping: float = 0.0
    zero: float = 0.0


def clock(count: int, dt: float) -> Floats:
    """Times (count,) of a uniform grid from 0, s."""
    return np.asarray(np.arange(count) * dt, dtype=np.float64)


def instant(s: State) -> History:
    """One state as a history of one point, for effects that are written for arrays and remember nothing."""
    one = np.array
    return History(
        t=one([s.t]),
        dt=0.0,
        command=one([s.command]),
        flow=one([s.flow]),
        water_temperature=one([s.water_temperature]),
        volts=one([s.volts]),
        n=one([s.n]),
        acceleration=one([s.acceleration]),
        thrust=one([s.thrust]),
        force=one([s.force]),
        reading=one([s.reading]),
        current=one([s.current]),
        input_current=one([s.input_current]),
        bus_voltage=one([s.bus_voltage]),
        motor_rise=one([s.motor_rise]),
        terminals=one([s.terminals]),
        flux=one([s.flux]),
        rate_per_volt=s.rate_per_volt,
        thrust_constant=s.thrust_constant,
        drag=s.drag,
        torque_acceleration=s.torque_acceleration,
        nominal_bus=s.nominal_bus,
        stand_frequency=s.stand_frequency,
        stand_damping=s.stand_damping,
        zero=s.zero,
    )
