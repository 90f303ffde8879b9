"""What the motor controller measures at its own terminals, in its own units, from the world."""

from __future__ import annotations

from math import copysign

from sim_devices.instruments.vesc.codec import Telemetry
from sim_devices.instruments.vesc.controller import Vesc
from sim_devices.world import World

SECONDS_PER_HOUR = 3600.0


class MotorTap:
    """Counts turns and charge while the world runs; `telemetry` is the controller's view of now."""

    def __init__(self, world: World, pole_pairs: int, controller_id: int) -> None:
        self._world, self._pole_pairs, self._id = world, pole_pairs, controller_id
        self._turns = self._turns_abs = 0.0
        self._charge = [0.0, 0.0]
        self._energy = [0.0, 0.0]
        self.vesc: Vesc | None = None

    def after_step(self, dt: float) -> None:
        """Account for one world step of dt (s)."""
        s = self._world.state
        self._turns += s.n * dt
        self._turns_abs += abs(s.n) * dt
        back = 0 if s.input_current >= 0.0 else 1
        amount = abs(s.input_current) * dt / SECONDS_PER_HOUR
        self._charge[back] += amount
        self._energy[back] += amount * s.bus_voltage
        if self.vesc is not None:
            self.vesc.average(self._drawn(s.current), s.input_current, s.current, s.volts)

    def _drawn(self, current: float) -> float:
        """Firmware sign of the motor current: positive when the motor takes power, whatever the direction."""
        s = self._world.state
        return current * copysign(1.0, s.volts if s.volts != 0.0 else s.n)

    def telemetry(self) -> Telemetry:
        world, vesc = self._world, self.vesc
        s = world.state
        bus = world.sample("bus_voltage")
        current = world.sample("current")
        duty = s.command / s.nominal_bus if s.driven else s.volts / s.bus_voltage
        return Telemetry(
            erpm=world.sample("rotation_rate") * 60.0 * self._pole_pairs,
            current=self._drawn(current),
            duty=min(max(duty, -1.0), 1.0),
            input_current=world.sample("input_current"),
            bus_voltage=bus,
            fet_temperature=world.sample("fet_temperature"),
            motor_temperature=world.sample("motor_temperature"),
            i_q=current,
            v_q=s.volts,
            charge=self._charge[0],
            charge_back=self._charge[1],
            energy=self._energy[0],
            energy_back=self._energy[1],
            tachometer=int(self._turns * 6 * self._pole_pairs),
            tachometer_abs=int(self._turns_abs * 6 * self._pole_pairs),
            position=self._turns * 360.0 % 360.0,
            fault=vesc.code if vesc else 0,
            controller_id=self._id,
            timed_out=vesc.timed_out if vesc else False,
        )
