"""A whole run at once: arrays in, arrays out, a hundred times faster than stepping. The rotor is always `instant`.

The same physics as `World` with `rotor = "instant"`, from the array form of the effects; tests hold the two together.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim_devices.world.effects import Effect
from sim_devices.world.effects.electrical import SupplySag
from sim_devices.world.effects.motor import Heating
from sim_devices.world.filters import low_pass
from sim_devices.world.history import History, clock
from sim_devices.world.settings import WorldSettings, make_effects
from sim_devices.world.world import stand_of

Floats = NDArray[np.float64]

STILL = 1e-7
"""relative change of the bus voltage, or of the motor's warmth, below which a pass changes nothing that matters."""
PASSES = 12
"""A supply that sags by a quarter stands still after eight."""
WARM_PASSES = 100
"""Magnets that lose a ninth of their flux, which lets them draw and lose more, stand still after some forty."""


def sweep(
    settings: WorldSettings, dt: float, command: Floats, flow: Floats, water_temperature: Floats, start: float = 0.0
) -> History:
    """The run of the mounted thruster over a uniform grid of `dt` s, from rest.

    `command` (n,) V, `flow` (n,) m/s, `water_temperature` (n,) degC, `start` s of the first
    point. `reading` of the result is the force as the cell
    has it, before noise, `cell` settings and effects of the output stage.
    """
    effects = make_effects(settings.effects)
    h = _at_rest(settings, dt, command, flow, water_temperature)
    h.t = start + h.t
    h.stand_frequency, h.stand_damping = stand_of(effects)
    _rotor(settings, effects, h)
    warms = any(isinstance(e, Heating) for e in effects)
    for _ in range(_passes(effects)):
        bus, rise = h.bus_voltage, h.motor_rise
        _rotor(settings, effects, h)
        warmed = np.max(np.abs(h.motor_rise - rise)) if warms else 0.0
        if np.max(np.abs(h.bus_voltage - bus)) < STILL * h.nominal_bus and warmed <= STILL * np.max(h.motor_rise):
            break
    h.thrust = _through(effects, "hydro", h.thrust_constant * h.n * np.abs(h.n), h)
    h.force = _through(effects, "stand", h.thrust, h)
    h.reading = _through(effects, "cell", h.force, h)
    return h


def _passes(effects: list[Effect]) -> int:
    """More after the first: what sags or warms with the current moves the current, without an exponent only the bus."""
    sag = [e.exponent for e in effects if isinstance(e, SupplySag)]
    if any(isinstance(e, Heating) for e in effects):
        return WARM_PASSES
    if any(sag):
        return PASSES
    return 1 if sag else 0


def _rotor(settings: WorldSettings, effects: list[Effect], h: History) -> None:
    """Command to rotation rate, currents and temperature."""
    thruster = settings.thrusters[settings.mounted]
    h.terminals = _through(effects, "command", h.command, h)
    h.volts = _through(effects, "motor", h.terminals, h)
    h.n = _through(effects, "rotor", h.rate_per_volt * h.volts, h)
    h.current = (h.drag * h.n * np.abs(h.n) + h.acceleration) / (h.torque_acceleration * h.flux)
    h.input_current = np.asarray(h.current * h.terminals / np.maximum(h.bus_voltage, 1.0))
    h.motor_rise = low_pass(thruster.heating * h.current**2, thruster.heating_time, h.dt)


def _through(effects: list[Effect], stage: str, value: Floats, h: History) -> Floats:
    for effect in effects:
        if effect.stage == stage:
            value = effect.over(value, h)
    return value


def _at_rest(settings: WorldSettings, dt: float, command: Floats, flow: Floats, water_temperature: Floats) -> History:
    thruster, zero = settings.thrusters[settings.mounted], np.zeros(command.size)
    return History(
        t=clock(command.size, dt),
        dt=dt,
        command=command,
        flow=flow,
        water_temperature=water_temperature,
        volts=zero,
        n=zero,
        acceleration=zero,
        thrust=zero,
        force=zero,
        reading=zero,
        current=zero,
        input_current=zero,
        bus_voltage=np.full(command.size, settings.supply.voltage),
        motor_rise=zero,
        terminals=zero,
        flux=np.ones(command.size),
        rate_per_volt=thruster.rate_per_volt,
        thrust_constant=thruster.C / thruster.rate_per_volt**2,
        drag=thruster.drag,
        torque_acceleration=thruster.torque_acceleration,
        nominal_bus=settings.supply.voltage,
        zero=settings.cell.zero_offset,
    )
