"""Device side of a Roboteq motor controller on a serial line: what it obeys, when it stops, how it goes on again.

Source: Roboteq, Advanced Digital Motor Controller manual V2.1: each character is echoed unless ECHOF is 1; a command
ends with CR or `_` and gets `+` or `-`; a query gets `NAME=v1:v2`. The serial watchdog (RWD, ms) is fed by `!` commands
alone. After it the motor stops, **and the next valid `!` command, whichever, lets it go on at the speed that ran
before**. `!EX` stops until `!MG`. A controller with a fault gives no power.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf

from sim_devices.instruments.roboteq.options import Measured, RoboteqOptions
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

FULL = 1000
BOOT_TIME = 1.0
"""s"""
BUFFER = 64
"""Characters of a command that the controller takes; what is longer is forgotten."""
FAULT_BITS = {"over_temperature": 0x01, "under_voltage": 0x04, "over_current": 0x08, "emergency_stop": 0x10}
"""FF: overheat, undervoltage, short circuit, emergency stop."""
STALL_BIT, PULSE_BIT, SERIAL_BIT = 0x02, 0x02, 0x01
"""FM: stall; FS: pulse mode, serial mode."""

Log = Callable[..., None]
"""log(event, **fields): the truth log."""


class Roboteq:
    """One controller, its motor on channel 1. `measure` gives what it measures now; `log` writes to the truth."""

    faults = ("frozen", "silent", "broken_watchdog", "over_current", "over_temperature", "under_voltage",
              "emergency_stop", "stall", "pulse_mode", "reboot", "ignores_commands", "backwards", "redrives",
              "rate_factor", "current_factor")  # fmt: skip

    def __init__(self, options: RoboteqOptions, nominal_bus: float, measure: Callable[[], Measured], log: Log) -> None:
        """`nominal_bus`: V that the whole power stands for in the world's `volts`."""
        self._options, self._bus, self._measure, self._log = options, nominal_bus, measure, log
        self._fault, self._amount = "", DEFAULT_AMOUNT
        self._frozen: tuple[Measured, float] | None = None
        """What it tells: measurements, and the power that goes with them."""
        self._boots_at = inf
        self._start()

    def _start(self) -> None:
        """As after power-up: nothing runs until somebody commands it."""
        self._target, self._power = 0, 0.0
        self._running, self._fed = False, -inf
        self._fault_flags = self._motor_flags = 0
        self._echo, self._buffer = self._options.echo, b""

    # -- the motor ---------------------------------------------------------------------------------------------------

    @property
    def power(self) -> float:
        """Per mille of the supply that the motor gets now."""
        return self._power

    def drive(self, _n: float, dt: float) -> tuple[float | None, float]:
        """(volts, amps) for one world step: volts None means that the windings carry amps."""
        if self._fault == "redrives":
            return self._amount * self._bus, 0.0
        wanted = float(self._target if self._running and not self._fault_flags and not self._motor_flags else 0)
        step = FULL / self._options.ramp * dt if self._options.ramp else inf
        self._power = min(max(wanted, self._power - step), self._power + step)
        if self._power == 0.0 and self._options.at_zero == "coast":
            return None, 0.0
        return self._power / FULL * (-self._bus if self._fault == "backwards" else self._bus), 0.0

    # -- time --------------------------------------------------------------------------------------------------------

    @property
    def due(self) -> float:
        if self._boots_at < inf:
            return self._boots_at
        o = self._options
        broken = o.broken_watchdog or self._fault == "broken_watchdog"
        return inf if not self._running or broken or o.watchdog == 0 else self._fed + o.watchdog * 1e-3

    def tick(self, t: float) -> bytes:
        """Its boot and its watchdog; it says nothing by itself."""
        if t >= self.due:
            if self._boots_at < inf:
                self._boots_at = inf
            else:
                self._running = False
                self._log("timeout", volts=0.0, after=t - self._fed)
        return b""

    # -- the line ----------------------------------------------------------------------------------------------------

    def feed(self, data: bytes, t: float) -> bytes:
        """What the host sent, character by character; returns echo and answers."""
        self.tick(t)
        if self._boots_at < inf or self._fault == "silent":
            return b""
        said = b""
        for code in data:
            character = bytes((code,))
            said += character if self._echo else b""
            if character not in (b"\r", b"_"):
                self._buffer = (self._buffer + character)[-BUFFER:]
                continue
            words, self._buffer = self._buffer.decode("ascii", "replace").strip(), b""
            said += self._execute(words, t) if words else b""
        return said

    def _execute(self, words: str, t: float) -> bytes:
        kind, (name, *arguments) = words[0], words[1:].upper().split() or [""]
        try:
            numbers = [int(argument) for argument in arguments]
        except ValueError:
            return b"-\r"
        match kind:
            case "!":
                return b"+\r" if self._command(name, numbers, t) else b"-\r"
            case "?":
                return self._answer(name, self._value(name, numbers))
            case "~":
                return self._answer(name, self._setting(name, numbers))
            case "^" if name == "ECHOF" and numbers in ([0], [1]):
                self._echo = numbers == [0]
                return b"+\r"
        return b"-\r"

    @staticmethod
    def _answer(name: str, value: str | None) -> bytes:
        return b"-\r" if value is None else f"{name}={value}\r".encode("ascii")

    def _command(self, name: str, numbers: list[int], t: float) -> bool:
        """A `!` command; whether it was valid. Every valid one feeds the watchdog, and what ran before goes on."""
        match name, numbers:
            case ("G", [int() as channel, int() as value]) if 1 <= channel <= self._options.channels:
                target = min(max(value, -FULL), FULL) if channel == 1 else self._target
            case ("G", [int() as value]):
                target = min(max(value, -FULL), FULL)
            case ("MS", [int() as channel]) if 1 <= channel <= self._options.channels:
                target = 0 if channel == 1 else self._target
            case ("EX", []):
                target = 0
                self._fault_flags |= FAULT_BITS["emergency_stop"]
            case ("MG", []):
                target = 0
                self._fault_flags &= ~FAULT_BITS["emergency_stop"]
            case ("AC" | "DC", [int() as channel, int()]) if 1 <= channel <= self._options.channels:
                target = self._target
            case _:
                return False
        if self._fault != "ignores_commands":
            self._obey(target, t)
        return True

    def _obey(self, target: int, t: float) -> None:
        changed = (target, True) != (self._target, self._running)
        self._target, self._running, self._fed = target, True, t
        if changed:
            self._log("command", mode="power", value=target, volts=target / FULL * self._bus)

    # -- what it tells -----------------------------------------------------------------------------------------------

    def _now(self) -> tuple[Measured, float]:
        if self._fault != "frozen" or self._frozen is None:
            self._frozen = self._measure(), self._power
        now, power = self._frozen
        match self._fault:
            case "rate_factor":
                return replace(now, rotation_rate=now.rotation_rate * self._amount), power
            case "current_factor":
                return replace(now, current=now.current * self._amount), power
            case _:
                return now, power

    def _value(self, name: str, numbers: list[int]) -> str | None:
        """A query's answer: of one channel when it is named, else of all; None: not understood."""
        now, power = self._now()
        if name in ("FID", "TRN", "FF", "FS"):
            status = PULSE_BIT if self._fault == "pulse_mode" else SERIAL_BIT
            said = {"FID": self._options.firmware, "TRN": f"RCB500:{self._options.model}"}
            return said.get(name, str(self._fault_flags if name == "FF" else status))
        of_board = {
            "V": (135, round(now.bus_voltage * 10), 4990),
            "T": (round(now.temperature), *[round(now.temperature)] * self._options.channels),
        }
        of_motor = {
            "A": round(now.current * 10),
            "BA": round(now.input_current * 10),
            "BS": round(now.rotation_rate * 60),
            "S": round(now.rotation_rate * 60),
            "P": round(power),
            "M": self._target,
            "FM": self._motor_flags,
        }
        values = of_board.get(name)
        if values is None and name in of_motor:
            values = (of_motor[name], *[0] * (self._options.channels - 1))
        return _picked(values, numbers)

    def _setting(self, name: str, numbers: list[int]) -> str | None:
        o = self._options
        others = o.channels - 1
        values: dict[str, tuple[int, ...]] = {
            "RWD": (o.watchdog,),
            "ECHOF": (int(not self._echo),),
            "MMOD": (o.mode, *[0] * others),
            "BPOL": (o.pole_pairs, *[2] * others),
            "EPPR": (o.encoder_pulses, *[100] * others),
        }
        return _picked(values.get(name), numbers)

    # -- faults ------------------------------------------------------------------------------------------------------

    def fault(self, name: str, t: float, amount: float = DEFAULT_AMOUNT) -> None:
        """Have one of `faults`. Those with a flag stop the motor, as the firmware does."""
        if name not in self.faults:
            raise ValueError(f"motor: expected one of {', '.join(self.faults)}, got {name!r}")
        if name == "reboot":
            self._start()
            self._boots_at = t + BOOT_TIME
        elif name in FAULT_BITS:
            self._fault_flags |= FAULT_BITS[name]
        elif name == "stall":
            self._motor_flags |= STALL_BIT
        else:
            self._fault, self._amount = name, amount

    def clear(self, _t: float) -> None:
        self._fault, self._fault_flags, self._motor_flags = "", 0, 0


def _picked(values: tuple[int, ...] | None, numbers: list[int]) -> str | None:
    if values is None or len(numbers) > 1:
        return None
    if not numbers:
        return ":".join(str(value) for value in values)
    return str(values[numbers[0] - 1]) if 1 <= numbers[0] <= len(values) else None
