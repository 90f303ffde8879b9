"""Device side of an ODrive axis on CAN: what it obeys, when it goes idle, what it tells.

Source: ODrive firmware 0.5, communication/can/can_simple.cpp (every frame to the axis feeds its watchdog; queries are
remote frames) and MotorControl/axis.cpp (watchdog_check: the axis is disarmed with an error and stays idle);
odrive-cansimple-0.6.10.dbc for the frames of 0.6. Set-points are kept in every state, and obeyed in closed loop alone.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace
from math import inf, isfinite

from sim_devices.instruments.odrive.options import Measured, ODriveOptions
from sim_devices.wires.can_frame import CanFrame
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

IDLE, CLOSED_LOOP = 1, 8
TORQUE_CONTROL, VELOCITY_CONTROL = 1, 2
HEARTBEAT, ENCODER, VELOCITY, TORQUE = 0x01, 0x09, 0x0D, 0x0E
IQ, TEMPERATURE, BUS = 0x14, 0x15, 0x17
ERRORS = {
    "0.6": {"watchdog": 0x1000000, "estop": 0x2000000, "over_current": 0x1000, "over_temperature": 0x4000,
            "under_voltage": 0x200, "spinout": 0x4000000},
    "0.5": {"watchdog": 0x800, "estop": 0x4000, "over_current": 0x40, "over_temperature": 0x40000,
            "under_voltage": 0x40, "spinout": 0x200},
}  # fmt: skip
BOOT_TIME = 1.0
"""s"""

Log = Callable[..., None]
"""log(event, **fields): the truth log."""


class ODriveAxis:
    """One axis. `gain` gives rev/s of its motor at 1 V; `measure` what it measures now; `log` writes to the truth."""

    faults = ("frozen", "silent", "broken_watchdog", "over_current", "over_temperature", "under_voltage", "spinout",
              "reboot", "ignores_commands", "backwards", "redrives", "disarms", "rate_factor",
              "current_factor")  # fmt: skip

    def __init__(
        self,
        options: ODriveOptions,
        nominal_bus: float,
        gain: Callable[[], float],
        measure: Callable[[], Measured],
        log: Log,
    ) -> None:
        self._options, self._bus, self._gain, self._measure, self._log = options, nominal_bus, gain, measure, log
        self._fault, self._amount = "", DEFAULT_AMOUNT
        self._codes = ERRORS[options.firmware]
        self._sent = {HEARTBEAT: options.heartbeat, ENCODER: options.encoder, IQ: options.iq, BUS: options.bus_voltage,
                      TEMPERATURE: options.temperature}  # fmt: skip
        self._next = {command: 1.0 / rate if rate else inf for command, rate in self._sent.items()}
        self._frozen: Measured | None = None
        self._turns, self._boots_at = 0.0, inf
        self._start(0.0)

    def _start(self, t: float) -> None:
        """As after power-up."""
        self._state, self._error = IDLE, 0
        self._control, self._inputs = VELOCITY_CONTROL, {VELOCITY: 0.0, TORQUE: 0.0}
        self._fed, self._told = t, (False, 0.0)

    # -- the motor ---------------------------------------------------------------------------------------------------

    @property
    def state(self) -> int:
        return self._state

    @property
    def error(self) -> int:
        return self._error

    def drive(self, n: float, dt: float) -> tuple[float | None, float]:
        """(volts, amps) for one world step: the velocity loop is stiff, torque is current."""
        self._turns += n * dt
        if self._fault == "redrives":
            return self._amount * self._bus, 0.0
        if self._state != CLOSED_LOOP:
            return None, 0.0
        sign = -1.0 if self._fault == "backwards" else 1.0
        if self._control == TORQUE_CONTROL:
            return None, sign * self._inputs[TORQUE] / self._options.torque_constant
        limit = self._options.velocity_limit
        volts = min(max(self._inputs[VELOCITY], -limit), limit) / self._gain()
        return sign * min(max(volts, -self._bus), self._bus), 0.0

    # -- time --------------------------------------------------------------------------------------------------------

    @property
    def due(self) -> float:
        return self._boots_at if self._boots_at < inf else min(self._expiry(), *self._next.values())

    def _expiry(self) -> float:
        o = self._options
        off = o.broken_watchdog or self._fault == "broken_watchdog" or o.timeout <= 0.0
        return inf if off or self._error & self._codes["watchdog"] else self._fed + o.timeout

    def tick(self, t: float) -> list[CanFrame]:
        """Everything it does by itself until t: the watchdog first, then its messages."""
        if self._boots_at < inf:
            if t < self._boots_at:
                return []
            self._boots_at = inf
            self._start(t)
        if t >= self._expiry():
            self._log("timeout", volts=0.0, after=t - self._fed)
            self._disarm(self._codes["watchdog"])
        commands = []
        for command, rate in self._sent.items():
            while self._next[command] <= t:
                late = t - self._next[command] > 1.0  # s: switched off meanwhile, nothing to catch up
                self._next[command] = (t if late else self._next[command]) + 1.0 / rate
                commands.append(command)
        return [] if self._fault == "silent" else [self._message(command) for command in commands]

    def _disarm(self, error: int) -> None:
        self._error |= error
        self._state = IDLE
        self._note()

    # -- the bus -----------------------------------------------------------------------------------------------------

    def receive(self, frame: CanFrame, t: float) -> list[CanFrame]:
        """A frame from the bus; returns the answers."""
        if frame.extended or frame.id >> 5 != self._options.node_id:
            return []
        if self._boots_at < inf or self._fault in ("silent", "ignores_commands"):
            return []
        self.tick(t)
        self._fed = t
        command = frame.id & 0x1F
        if frame.remote or (not frame.data and command in self._sent):
            return [self._message(command)] if command in self._sent else []
        self._obey(command, frame.data, t)
        self._note()
        return []

    def _obey(self, command: int, data: bytes, t: float) -> None:
        match command:
            case 0x02:  # Estop
                self._disarm(self._codes["estop"])
            case 0x07 if len(data) >= 4:  # Set_Axis_State
                self._ask_state(int.from_bytes(data[:4], "little"))
            case 0x0B if len(data) >= 8:  # Set_Controller_Mode
                self._control = int.from_bytes(data[:4], "little")
            case 0x0D | 0x0E if len(data) >= 4:  # Set_Input_Vel, Set_Input_Torque
                (value,) = struct.unpack("<f", data[:4])
                self._inputs[command] = value if isfinite(value) else 0.0
            case 0x16:  # Reboot
                self._boots_at = t + BOOT_TIME
            case 0x18:  # Clear_Errors
                self._error = 0

    def _ask_state(self, state: int) -> None:
        if state == IDLE:
            self._state = IDLE
        elif state == CLOSED_LOOP and self._options.calibrated and not self._error:
            self._state = CLOSED_LOOP

    def _note(self) -> None:
        """Tell the truth what the motor is driven with from now on, where that is another thing than before."""
        driven = self._state == CLOSED_LOOP
        value = self._inputs[TORQUE if self._control == TORQUE_CONTROL else VELOCITY] if driven else 0.0
        if (driven, value) == self._told:
            return
        self._told = (driven, value)
        mode = ("torque" if self._control == TORQUE_CONTROL else "velocity") if driven else "idle"
        volts = None if mode == "torque" and value else value / self._gain()
        self._log("command", mode=mode, value=value, volts=volts)

    # -- what it tells -----------------------------------------------------------------------------------------------

    def _now(self) -> Measured:
        if self._fault != "frozen" or self._frozen is None:
            self._frozen = self._measure()
        now, amount = self._frozen, self._amount
        match self._fault:
            case "rate_factor":
                return replace(now, rotation_rate=now.rotation_rate * amount)
            case "current_factor":
                return replace(now, current=now.current * amount)
            case _:
                return now

    def _message(self, command: int) -> CanFrame:
        now = self._now()
        match command:
            case 0x01:  # Heartbeat
                data = struct.pack("<IBBBB", self._error, self._state, 0, 0, 0)
            case 0x09:  # Get_Encoder_Estimates
                data = struct.pack("<ff", self._turns, now.rotation_rate)
            case 0x14:  # Get_Iq
                data = struct.pack("<ff", self._inputs[TORQUE] / self._options.torque_constant, now.current)
            case 0x15:  # Get_Temperature
                data = struct.pack("<ff", now.fet_temperature, now.motor_temperature)
            case _:
                data = struct.pack("<ff", now.bus_voltage, now.input_current)
        return CanFrame(self._options.node_id << 5 | command, data, extended=False)

    # -- faults ------------------------------------------------------------------------------------------------------

    def fault(self, name: str, t: float, amount: float = DEFAULT_AMOUNT) -> None:
        """Have one of `faults`. Those with an error disarm the axis, as the firmware does."""
        if name not in self.faults:
            raise ValueError(f"motor: expected one of {', '.join(self.faults)}, got {name!r}")
        if name == "reboot":
            self._disarm(0)
            self._boots_at = t + BOOT_TIME
        elif name == "disarms":
            self._disarm(0)
        elif name in self._codes:
            self._disarm(self._codes[name])
        else:
            self._fault, self._amount = name, amount

    def clear(self, _t: float) -> None:
        self._fault, self._error = "", 0
