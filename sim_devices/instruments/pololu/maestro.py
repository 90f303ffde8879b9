"""Device side of a Pololu Maestro with an ESC on one channel: packets in, pulses out, and its serial timeout.

Source: Pololu Maestro Servo Controller User's Guide (0J40), 4.b errors, 5.a serial settings, 5.c protocols, 5.d CRC-7,
5.e commands: 84 ch lo hi target in quarters of a microsecond (0: no pulses), 87 speed, 89 acceleration, 90 ch position,
A1 errors (read and cleared), A2 go home. Any error sends the channel home, as "on startup or error" says. The serial
timeout is fed by every valid command.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, inf

from sim_devices.instruments.pololu.esc import Arming, Esc
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

CRC_ERROR, PROTOCOL_ERROR, TIMEOUT = 1 << 3, 1 << 4, 1 << 5
BOOT_TIME = 1.0
"""s"""
DATA_BYTES = {0x84: 3, 0x87: 3, 0x89: 3, 0x90: 1, 0x93: 0, 0xA1: 0, 0xA2: 0}

Log = Callable[..., None]
"""log(event, **fields): the truth log."""


@dataclass(frozen=True, slots=True)
class MaestroOptions:
    """`[devices.<name>]` of kind maestro."""

    kind: str
    port: str
    baud: int = 115200
    channel: int = 0
    """The ESC's."""
    timeout: float = 0.0
    """s, serial timeout; 0, as delivered: off."""
    broken_watchdog: bool = False
    """The timeout sets its flag and leaves the channel as it is."""
    on_error: str = "off"
    """`off`, as delivered; `go_to`, `ignore`."""
    home: float = 1500.0
    """us, of `go_to`."""
    min_pulse: float = 992.0
    """us: targets are held within these."""
    max_pulse: float = 2000.0
    period: float = 0.02
    """s between two pulses, where a new width begins."""
    crc: bool = False
    device_number: int = 12
    neutral: float = 1500.0
    """us, of the ESC, as what follows."""
    dead_zone: float = 25.0
    reach: float = 400.0
    """us from neutral to full."""
    arming: float = 2.0
    """s of neutral until it obeys."""
    at_zero: str = "coast"
    """At neutral the windings are open; `brake`: shorted."""

    def __post_init__(self) -> None:
        if self.on_error not in ("off", "go_to", "ignore") or self.at_zero not in ("brake", "coast"):
            raise ValueError(
                "on_error must be off, go_to or ignore, at_zero brake or coast, got"
                f" {self.on_error!r} and {self.at_zero!r}"
            )
        if not (self.timeout >= 0.0 and self.period > 0.0 and 0.0 <= self.dead_zone < self.reach):
            raise ValueError("timeout >= 0 s, period above 0 s and a dead_zone below reach are needed")


class Maestro:
    """One channel of it and the ESC there. `bus`: V that all of the ESC's output is; `log` writes to the truth."""

    faults = ("frozen", "silent", "broken_watchdog", "protocol_error", "crc_error", "reboot", "ignores_commands",
              "backwards", "redrives", "esc_off")  # fmt: skip

    def __init__(self, options: MaestroOptions, bus: float, log: Log) -> None:
        self._options, self._bus, self._log = options, bus, log
        self._esc = Esc(options.neutral, options.dead_zone, options.reach, options.arming)
        self._fault, self._amount = "", DEFAULT_AMOUNT
        self._frozen = 0
        self._boots_at = inf
        self._start()

    def _start(self) -> None:
        """As after power-up: on startup is as on error."""
        self._packet = b""
        self._errors = 0
        self._fed = inf
        """s of the last command; infinity: none yet, or the timeout came."""
        self._pulse = self._wanted = 0
        self._changes_at = inf
        self._arming = Arming(self._esc)
        self._go_home()

    # -- the motor ---------------------------------------------------------------------------------------------------

    @property
    def pulse(self) -> float:
        """What goes out now, us; 0: none."""
        return self._pulse / 4

    @property
    def obeys(self) -> bool:
        """Whether the ESC is armed."""
        return self._arming.obeys

    @property
    def volts(self) -> float:
        """What the ESC gives the motor by its pulse."""
        return self._esc.share(self.pulse) * self._bus if self._pulse and self.obeys else 0.0

    def drive(self, _n: float, dt: float) -> tuple[float | None, float]:
        """(volts, amps) for one world step: volts None means that the windings carry amps."""
        self._arming.pass_time(self.pulse, dt)
        if self._fault == "redrives":
            return self._amount * self._bus, 0.0
        volts = 0.0 if self._fault == "esc_off" else self.volts
        if volts == 0.0:
            return (None, 0.0) if self._options.at_zero == "coast" else (0.0, 0.0)
        return (-volts if self._fault == "backwards" else volts), 0.0

    # -- time --------------------------------------------------------------------------------------------------------

    @property
    def due(self) -> float:
        if self._boots_at < inf:
            return self._boots_at
        expiry = self._fed + self._options.timeout if self._options.timeout else inf
        return min(self._changes_at, expiry)

    def tick(self, t: float) -> bytes:
        """Its boot, its next pulse and its timeout; it says nothing by itself."""
        if t >= self._boots_at:
            self._boots_at = inf
        if t >= self._changes_at:
            self._changes_at = inf
            self._put_out(self._wanted)
        if self._options.timeout and t >= self._fed + self._options.timeout:
            self._fed = inf
            self._errors |= TIMEOUT
            if not (self._options.broken_watchdog or self._fault == "broken_watchdog"):
                self._go_home()
            self._log("timeout", volts=self.volts, after=self._options.timeout)
        return b""

    def _go_home(self) -> None:
        if self._options.on_error != "ignore":
            self._wanted = round(4 * self._options.home) if self._options.on_error == "go_to" else 0
            self._changes_at = inf
            self._put_out(self._wanted)

    def _put_out(self, quarters: int) -> None:
        if quarters != self._pulse:
            self._pulse = quarters
            self._log("command", mode="pulse", value=self.volts, volts=self.volts, pulse=self.pulse)

    def _fail(self, flag: int) -> None:
        self._errors |= flag
        self._go_home()

    # -- the line ----------------------------------------------------------------------------------------------------

    def feed(self, data: bytes, t: float) -> bytes:
        """What the host sent; returns the answers."""
        self.tick(t)
        if self._boots_at < inf or self._fault == "silent":
            return b""
        said = b""
        for byte in data:
            if byte & 0x80 and self._packet:
                self._packet = b""
                self._fail(PROTOCOL_ERROR)
            if not byte & 0x80 and not self._packet:
                continue  # a device that is not spoken to
            self._packet += bytes((byte,))
            if (length := self._length()) and len(self._packet) >= length:
                packet, self._packet = self._packet, b""
                said += self._take(packet, t)
        return said

    def _length(self) -> int:
        """Bytes of the packet that has begun; 0: not known yet."""
        head = 1
        command = self._packet[0]
        if command == 0xAA:
            if len(self._packet) < 3:
                return 0
            head, command = 3, self._packet[2] | 0x80
        return head + DATA_BYTES.get(command, 0) + self._options.crc

    def _take(self, packet: bytes, t: float) -> bytes:
        if self._options.crc:
            if checksum(packet[:-1]) != packet[-1]:
                self._fail(CRC_ERROR)
                return b""
            packet = packet[:-1]
        if packet[0] == 0xAA:
            if packet[1] != self._options.device_number:
                return b""
            packet = bytes((packet[2] | 0x80,)) + packet[3:]
        if packet[0] not in DATA_BYTES:
            self._fail(PROTOCOL_ERROR)
            return b""
        if self._fault != "ignores_commands" or packet[0] in (0x90, 0xA1):
            self._fed = t
            return self._execute(packet[0], packet[1:], t)
        return b""

    def _execute(self, command: int, data: bytes, t: float) -> bytes:
        match command:
            case 0x84 if data[0] == self._options.channel:
                self._want(data[1] | data[2] << 7, t)
            case 0x90:
                if self._fault != "frozen":
                    self._frozen = self._pulse if data[0] == self._options.channel else 0
                return self._frozen.to_bytes(2, "little")
            case 0x93:
                return bytes(1)
            case 0xA1:
                errors, self._errors = self._errors, 0
                return errors.to_bytes(2, "little")
            case 0xA2:
                self._go_home()
        return b""

    def _want(self, quarters: int, t: float) -> None:
        o = self._options
        if quarters:
            quarters = min(max(quarters, round(4 * o.min_pulse)), round(4 * o.max_pulse))
        self._wanted = quarters
        self._changes_at = inf if quarters == self._pulse else ceil(t / o.period) * o.period

    # -- faults ------------------------------------------------------------------------------------------------------

    def fault(self, name: str, t: float, amount: float = DEFAULT_AMOUNT) -> None:
        """Have one of `faults`."""
        if name not in self.faults:
            raise ValueError(f"motor: expected one of {', '.join(self.faults)}, got {name!r}")
        match name:
            case "reboot":
                self._start()
                self._boots_at = t + BOOT_TIME
            case "protocol_error":
                self._fail(PROTOCOL_ERROR)
            case "crc_error":
                self._fail(CRC_ERROR)
            case _:
                self._fault, self._amount = name, amount

    def clear(self, _t: float) -> None:
        self._fault = ""


def checksum(data: bytes) -> int:
    """CRC-7 as the guide's own C code makes it, bit by bit from the lowest (5.d)."""
    crc = 0
    for byte in data:
        for bit in range(8):
            crc ^= byte >> bit & 1
            crc = crc >> 1 ^ 0x48 if crc & 1 else crc >> 1
    return crc
