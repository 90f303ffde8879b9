"""Device side of a Pololu Simple Motor Controller G2 on a serial line: speed, safe-start, command timeout, variables.

Source: Pololu Simple Motor Controller G2 User's Guide (0J77), 3.3 errors, 6.1 serial settings, 6.2.1 binary commands:
83 exit safe start, 85/86 lo5 hi7 forward/reverse 0 to 3200, 92 brake, A1 id variable, C2 firmware, E0 stop; 6.4
variables: 0 errors that stop the motor, 1 errors since last read, 20 target, 21 speed, 23 V_in in mV, 24 temperature in
0.1 degC, 46 current in mA. An error stops the motor, and with safe-start it stays stopped until 83. The command timeout
is fed by every valid command.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

from sim_devices.instruments.pololu.maestro import checksum
from sim_devices.wires.serial_line import DEFAULT_AMOUNT
from sim_devices.world import World

FULL = 3200
SAFE_START, SERIAL, TIMEOUT, KILL, LOW_VIN, TEMPERATURE, DRIVER = 1, 1 << 2, 1 << 3, 1 << 4, 1 << 5, 1 << 7, 1 << 8
BOOT_TIME = 1.0
"""s"""
DATA_BYTES = {0x83: 0, 0x85: 2, 0x86: 2, 0x92: 1, 0xA1: 1, 0xC2: 0, 0xE0: 0}
FLAGGED = {"kill_switch": KILL, "under_voltage": LOW_VIN, "over_temperature": TEMPERATURE, "over_current": DRIVER}
"""Faults that are errors for as long as they last."""

Log = Callable[..., None]
"""log(event, **fields): the truth log."""


@dataclass(frozen=True, slots=True)
class SmcG2Options:
    """`[devices.<name>]` of kind smc_g2."""

    kind: str
    port: str
    baud: int = 115200
    timeout: float = 0.0
    """s, command timeout; 0, as delivered: off."""
    broken_watchdog: bool = False
    """The timeout tells its error and stops nothing."""
    safe_start: bool = True
    crc: bool = False
    device_number: int = 13
    at_zero: str = "coast"
    """At speed 0 the windings are open; `brake`: shorted."""
    product: int = 160
    firmware: int = 0x0104

    def __post_init__(self) -> None:
        if self.at_zero not in ("brake", "coast") or self.timeout < 0.0:
            raise ValueError(
                f"at_zero brake or coast and timeout >= 0 s are needed, got {self.at_zero!r}, {self.timeout}"
            )


@dataclass(frozen=True, slots=True)
class Measured:
    """A, V, degC."""

    current: float = 0.0
    bus_voltage: float = 48.0
    temperature: float = 25.0


def measured(world: World) -> Measured:
    """The controller's view of the world now."""
    return Measured(abs(world.sample("current")), world.sample("bus_voltage"), world.sample("fet_temperature"))


class SmcG2:
    """One controller. `bus`: V that full speed stands for in the world; `measure` gives what it measures now."""

    faults = ("frozen", "silent", "broken_watchdog", "ignores_commands", "backwards", "redrives", "reboot",
              "serial_error", *FLAGGED)  # fmt: skip

    def __init__(self, options: SmcG2Options, bus: float, measure: Callable[[], Measured], log: Log) -> None:
        self._options, self._bus, self._measure, self._log = options, bus, measure, log
        self._fault, self._amount = "", DEFAULT_AMOUNT
        self._frozen = (Measured(), 0)
        self._boots_at = inf
        self._start()

    def _start(self) -> None:
        self._packet = b""
        self._target = self._speed = 0
        self._fed = inf
        self._lasting = 0
        self._status = SAFE_START if self._options.safe_start else 0
        self._occurred = self._status

    # -- the motor ---------------------------------------------------------------------------------------------------

    @property
    def speed(self) -> int:
        """What the motor gets, -3200 to 3200."""
        return self._speed

    def drive(self, _n: float, _dt: float) -> tuple[float | None, float]:
        """(volts, amps) for one world step: volts None means that the windings carry amps."""
        if self._fault == "redrives":
            return self._amount * self._bus, 0.0
        if self._speed == 0:
            return (None, 0.0) if self._options.at_zero == "coast" else (0.0, 0.0)
        volts = self._speed / FULL * self._bus
        return (-volts if self._fault == "backwards" else volts), 0.0

    def _settle(self) -> None:
        """What target and errors make of the speed."""
        speed = 0 if self._status else self._target
        if speed != self._speed:
            self._speed = speed
            self._log("command", mode="speed", value=speed, volts=speed / FULL * self._bus)

    def _fail(self, flag: int) -> None:
        self._status |= flag | (SAFE_START if self._options.safe_start else 0)
        self._occurred |= self._status
        self._settle()

    # -- time --------------------------------------------------------------------------------------------------------

    @property
    def due(self) -> float:
        if self._boots_at < inf:
            return self._boots_at
        return self._fed + self._options.timeout if self._options.timeout else inf

    def tick(self, t: float) -> bytes:
        """Its boot and its timeout; it says nothing by itself."""
        if t >= self._boots_at:
            self._boots_at = inf
        if self._options.timeout and t >= self._fed + self._options.timeout:
            self._fed = inf
            if self._options.broken_watchdog or self._fault == "broken_watchdog":
                self._occurred |= TIMEOUT
            else:
                self._fail(TIMEOUT)
                self._log("timeout", volts=0.0, after=self._options.timeout)
        return b""

    # -- the line ----------------------------------------------------------------------------------------------------

    def feed(self, data: bytes, t: float) -> bytes:
        """What the host sent; returns the answers."""
        self.tick(t)
        if self._boots_at < inf or self._fault == "silent":
            return b""
        said = b""
        for byte in data:
            if byte & 0x80:
                if self._packet:
                    self._fail(SERIAL)
                self._packet = b""
            elif not self._packet:
                continue
            self._packet += bytes((byte,))
            head, command = (1, self._packet[0]) if self._packet[0] != 0xAA else (3, (self._packet + b"\0\0")[2] | 0x80)
            if len(self._packet) >= head and len(self._packet) == head + DATA_BYTES.get(command, 0) + self._options.crc:
                packet, self._packet = self._packet, b""
                said += self._take(packet, t)
        return said

    def _take(self, packet: bytes, t: float) -> bytes:
        if self._options.crc:
            if checksum(packet[:-1]) != packet[-1]:
                self._fail(SERIAL)
                return b""
            packet = packet[:-1]
        if packet[0] == 0xAA:
            if packet[1] != self._options.device_number:
                return b""
            packet = bytes((packet[2] | 0x80,)) + packet[3:]
        if packet[0] not in DATA_BYTES:
            self._fail(SERIAL)
            return b""
        if self._fault == "ignores_commands" and packet[0] not in (0xA1, 0xC2):
            return b""
        self._fed = t
        self._status &= ~(TIMEOUT | SERIAL)
        self._status |= self._lasting
        said = self._execute(packet[0], packet[1:])
        self._settle()
        return said

    def _execute(self, command: int, data: bytes) -> bytes:
        match command:
            case 0x83:
                self._status &= ~SAFE_START
            case 0x85 | 0x86:
                size = min(data[0] & 0x1F | data[1] << 5, FULL)
                self._target = size if command == 0x85 else -size
            case 0x92:
                self._target = 0
            case 0xE0:
                self._target = 0
                self._fail(0)
            case 0xA1:
                return (self._variable(data[0]) & 0xFFFF).to_bytes(2, "little")
            case 0xC2:
                return self._options.product.to_bytes(2, "little") + self._options.firmware.to_bytes(2, "little")
        return b""

    def _variable(self, number: int) -> int:
        if number == 1:
            occurred, self._occurred = self._occurred, 0
            return occurred
        if self._fault != "frozen":
            self._frozen = self._measure(), self._speed
        now, speed = self._frozen
        told = {
            0: self._status,
            20: self._target,
            21: speed,
            23: round(now.bus_voltage * 1e3),
            24: round(now.temperature * 10),
            46: round(now.current * 1e3),
        }
        return told.get(number, 0)

    # -- faults ------------------------------------------------------------------------------------------------------

    def fault(self, name: str, t: float, amount: float = DEFAULT_AMOUNT) -> None:
        """Have one of `faults`. Those that are errors stop the motor, as the firmware does."""
        if name not in self.faults:
            raise ValueError(f"motor: expected one of {', '.join(self.faults)}, got {name!r}")
        if name == "reboot":
            self._start()
            self._boots_at = t + BOOT_TIME
            self._log("command", mode="speed", value=0, volts=0.0)
        elif name == "serial_error":
            self._fail(SERIAL)
        elif name in FLAGGED:
            self._lasting |= FLAGGED[name]
            self._fail(FLAGGED[name])
        else:
            self._fault, self._amount = name, amount

    def clear(self, _t: float) -> None:
        self._fault = ""
        self._status &= ~self._lasting
        self._lasting = 0
        self._settle()
