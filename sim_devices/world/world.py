"""One thruster in a tunnel, on a stand, stepped at 1 kHz. Scalars only: a step costs a few microseconds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim_devices.tables import check_known
from sim_devices.world.effects import Effect
from sim_devices.world.effects.channel import ChannelFault
from sim_devices.world.effects.stand import StandResonance
from sim_devices.world.hysteresis import Plays
from sim_devices.world.noise import CHANNELS, Noise, NoiseSource
from sim_devices.world.settings import WorldSettings, make_effects
from sim_devices.world.state import State

REST_RATE = 0.5
"""rev/s: slower than this the thruster may be taken off the bench."""


class World:
    """The bench as physics has it. `step` moves it, `sample` reads a sensor, `state` is the truth."""

    def __init__(self, settings: WorldSettings, rng: np.random.Generator) -> None:
        self.settings = settings
        self.state = State(bus_voltage=settings.supply.voltage, nominal_bus=settings.supply.voltage)
        self.state.flow, self.state.zero = settings.tunnel.flow_speed, settings.cell.zero_offset
        self.state.water_temperature = settings.tunnel.water_temperature
        self._noise = {c: NoiseSource(settings.noise.get(c, Noise()), rng) for c in CHANNELS}
        self._effects = make_effects(settings.effects)
        self.state.stand_frequency, self.state.stand_damping = stand_of(self._effects)
        self._command = self._of_stage("command")
        self._motor = self._of_stage("motor")
        self._rotor = self._of_stage("rotor")
        self._hydro = self._of_stage("hydro")
        self._stand = self._of_stage("stand")
        self._cell = self._of_stage("cell")
        cell = settings.cell
        self._plays = Plays(cell.hysteresis, cell.hysteresis_reach) if cell.hysteresis else None
        self._outputs = {c: tuple(e for e in self._of_stage("output") if _concerns(e, c)) for c in CHANNELS}
        self._spin = 0.0
        """rev/s of the rotor before the effects of the rotor stage."""
        self.mounted = settings.mounted
        self._install()

    def mount(self, name: str) -> None:
        """Put another thruster on the bench. Raises ValueError while the rotor turns, WorldError for a name unknown."""
        check_known(name, self.settings.thrusters, "mount")
        if abs(self.state.n) > REST_RATE:
            raise ValueError(
                f"mount: {self.mounted} turns at {self.state.n:.1f} rev/s, expected rest (below {REST_RATE} rev/s); "
                "stop the motor first"
            )
        self.mounted = name
        self.state.n = self.state.motor_rise = self._spin = 0.0
        self._install()

    def _install(self) -> None:
        thruster, s = self.settings.thrusters[self.mounted], self.state
        self._thruster = thruster
        s.rate_per_volt = thruster.rate_per_volt
        s.thrust_constant = thruster.C / thruster.rate_per_volt**2
        s.drag = thruster.drag
        s.torque_acceleration = thruster.torque_acceleration

    def _of_stage(self, stage: str) -> tuple[Effect, ...]:
        return tuple(e for e in self._effects if e.stage == stage)

    def step(self, dt: float, volts: float | None, amps: float = 0.0) -> None:
        """Advance by dt (s) with `volts` at the motor; None: the windings carry `amps` instead (0 = coasting)."""
        s, th = self.state, self._thruster
        s.t += dt
        s.water_temperature = self.settings.tunnel.water_temperature + self.settings.tunnel.temperature_drift * s.t
        n = self._spin
        k, alpha = th.rate_per_volt, th.drag
        if volts is None:
            s.driven, s.command = False, 0.0
            s.volts, s.terminals = n / k, s.flux * n / k
            push, pull = th.torque_acceleration * s.flux * amps, th.friction
        else:
            s.driven, s.command = True, volts
            for e in self._command:
                volts = e.apply(volts, s, dt)
            s.terminals = volts
            for e in self._motor:
                volts = e.apply(volts, s, dt)
            s.volts = volts
            pull = th.stiffness
            push = alpha * k * k * volts * abs(volts) + pull * k * volts
        # Heun's rule for n' = push - pull n - alpha n|n|: second order, exact at the rest point
        slope = push - (pull + alpha * abs(n)) * n
        guess = n + dt * slope
        n = n + 0.5 * dt * (slope + push - (pull + alpha * abs(guess)) * guess)
        instant = th.rotor == "instant" and volts is not None
        if instant:
            n = k * s.volts
        self._spin = n
        s.current = amps if volts is None else (push - pull * n) / (th.torque_acceleration * s.flux)
        for e in self._rotor:
            n = e.apply(n, s, dt)
        s.n = n
        if instant:
            s.current = (alpha * n * abs(n) + s.acceleration) / (th.torque_acceleration * s.flux)
        s.input_current = s.current * s.terminals / s.bus_voltage if s.bus_voltage > 1.0 else 0.0
        s.motor_rise += (th.heating * s.current * s.current - s.motor_rise) * dt / th.heating_time
        self._forces(dt)

    def _forces(self, dt: float) -> None:
        s = self.state
        force = s.thrust_constant * s.n * abs(s.n)
        for e in self._hydro:
            force = e.apply(force, s, dt)
        s.thrust = force
        force += s.hung
        for e in self._stand:
            force = e.apply(force, s, dt)
        s.force = force
        for e in self._cell:
            force = e.apply(force, s, dt)
        s.reading = force + self._plays.follow(force) if self._plays else force

    def sample(self, channel: str) -> float:
        """What the sensor of `channel` gives now, with noise, clipping and fault. SI; NaN: no number."""
        return self.converted(channel, self.exact(channel))

    def converted(self, channel: str, value: float) -> float:
        """What the converter of `channel` makes of the value before it, now: noise, clipping and fault."""
        s = self.state
        value += self._noise[channel].sample(value, s.t)
        for e in self._outputs[channel]:
            value = e.apply(value, s, 0.0)
        return value

    def output_effects(self, channel: str) -> tuple[Effect, ...]:
        """What changes each sample of a channel after its noise: clipping, then a fault."""
        return self._outputs[channel]

    def exact(self, channel: str) -> float:
        """The sensor without noise and faults: gain error and zero offset of the cell are in it."""
        s = self.state
        match channel:
            case "thrust":
                cell, warmer = self.settings.cell, s.water_temperature - self.settings.cell.reference_temperature
                gain = 1.0 + cell.gain_error + cell.gain_temperature * warmer
                return s.reading * gain + cell.zero_offset + cell.zero_temperature * warmer
            case "rotation_rate":
                return s.n
            case "current":
                return s.current
            case "bus_voltage":
                return s.bus_voltage
            case "input_current":
                return s.input_current
            case "flow_speed":
                return s.flow
            case "pressure":
                return self.settings.tunnel.pressure
            case "water_temperature":
                return s.water_temperature
            case "motor_temperature":
                return s.water_temperature + s.motor_rise
            case "fet_temperature":
                return s.water_temperature + 5.0 + 0.5 * s.motor_rise
            case _:
                raise ValueError(f"sample: expected one of {', '.join(CHANNELS)}, got {channel!r}")


def stand_of(effects: Sequence[Effect]) -> tuple[float, float]:
    """Hz and damping of the stand, (0, 0) where it is rigid."""
    return next(((e.frequency, e.damping) for e in effects if isinstance(e, StandResonance)), (0.0, 0.0))


def _concerns(effect: Effect, channel: str) -> bool:
    """A fault sits on the channel it names; what clips, clips the load cell."""
    return channel == (effect.channel if isinstance(effect, ChannelFault) else "thrust")
