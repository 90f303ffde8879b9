"""What a bench file says of an ESC on a Pololu Maestro, the pulse that a voltage stands for, and the stream. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from drivers.pololu.packets import Packets
from drivers.ports.serial_port import SerialSettings
from drivers.protocols import Channel, Stream

QUARTERS = 4
"""Targets and positions are in quarters of a microsecond (0J40, 5.e)."""
MICROSECOND = 1e-6
CHANNELS = 24
"""Of the largest Maestro."""
LONGEST_TIMEOUT = 655.35
"""s: the serial timeout is 16 bits of hundredths of a second."""
FLAGS = (
    "serial signal error",
    "serial overrun",
    "serial buffer full",
    "serial CRC error",
    "serial protocol error",
    "serial timeout",
    "script stack error",
    "script call stack error",
    "script program counter error",
)
"""Bits of Get Errors, from bit 0 (0J40, 4.b)."""
TIMEOUT_FLAG = 1 << FLAGS.index("serial timeout")


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind maestro."""

    port: str
    channel: int
    """The Maestro's output that the ESC is on."""
    full_voltage: float
    """V that `max_pulse` stands for; `min_pulse` stands for the negative of it."""
    dead_zone: float
    """us on each side of neutral in which the ESC does not drive; a command other than 0 begins beyond it."""
    watchdog_timeout: float
    """s, serial timeout as set in the Maestro Control Center; it is measured at opening."""
    neutral: float = 1500.0
    """us"""
    min_pulse: float = 1100.0
    """us, full astern."""
    max_pulse: float = 1900.0
    """us, full ahead."""
    arming_time: float = 3.0
    """s of neutral that the ESC wants before it obeys; they pass at opening."""
    at_zero: Literal["brake", "coast"] = "coast"
    """What the ESC does at neutral; nothing on the wire tells."""
    protocol: Literal["compact", "pololu"] = "compact"
    device_number: int = 12
    """In the Pololu protocol."""
    crc: bool = False
    """As set in the Maestro."""
    baud: int = 115200
    """Of the TTL lines; over USB it does not matter."""
    rate: float = 50.0
    """Rows/s; they are asked with set-points, one a set-point at most."""
    timeout: float = 0.5
    """s for an answer at opening."""
    capture: str = ""
    """File that gets every byte with its time."""

    def __post_init__(self) -> None:
        SerialSettings(self.port, self.baud)
        for key, value, choices in (
            ("at_zero", self.at_zero, ("brake", "coast")),
            ("protocol", self.protocol, ("compact", "pololu")),
        ):
            if value not in choices:
                raise ValueError(f"maestro {key} must be {' or '.join(choices)}, not {value!r}")
        if not 0 <= self.channel < CHANNELS or not 0 <= self.device_number <= 127:
            raise ValueError(
                f"maestro channel must be 0 to {CHANNELS - 1} and device_number 0 to 127, not {self.channel} and"
                f" {self.device_number}"
            )
        if not 0.0 < self.full_voltage < math.inf:
            raise ValueError(f"maestro full_voltage must be positive, not {self.full_voltage}")
        self._check_pulses()
        if not 0.05 <= self.watchdog_timeout <= LONGEST_TIMEOUT:
            raise ValueError(
                f"maestro watchdog_timeout must be 0.05 to {LONGEST_TIMEOUT:g} s, not {self.watchdog_timeout}"
            )
        if not 0.0 <= self.arming_time <= 60.0 or not 0.0 < self.timeout <= 60.0:
            raise ValueError(
                f"maestro arming_time must be 0 to 60 s and timeout above 0, not {self.arming_time} and {self.timeout}"
            )
        if not 0.0 < self.rate <= 1000.0 or self.baud <= 0:
            raise ValueError(f"maestro rate must be 0 to 1000/s and baud above 0, not {self.rate} and {self.baud}")

    def _check_pulses(self) -> None:
        if not self.dead_zone >= 1.0:
            raise ValueError(
                f"maestro dead_zone must be at least 1 us (an ESC has one; its data sheet says it), not"
                f" {self.dead_zone}"
            )
        low, high = self.neutral - self.dead_zone, self.neutral + self.dead_zone
        if not 64.0 <= self.min_pulse < low or not high < self.max_pulse <= 4080.0:
            raise ValueError(
                f"maestro pulses must be 64 to 4080 us, min_pulse below and max_pulse above neutral +- dead_zone"
                f" ({low:g} to {high:g} us), not {self.min_pulse:g} and {self.max_pulse:g}"
            )

    @property
    def packets(self) -> Packets:
        return Packets(self.device_number if self.protocol == "pololu" else None, self.crc)

    @property
    def neutral_target(self) -> int:
        return round(QUARTERS * self.neutral)

    def target(self, volts: float) -> int:
        """The pulse, in quarters of a microsecond: neutral for 0 V; else neutral, the dead zone, and the share of the
        way to `max_pulse` (`min_pulse`) that volts is of `full_voltage`."""
        if volts == 0.0:
            return self.neutral_target
        end = self.max_pulse if volts > 0.0 else self.min_pulse
        begin = self.neutral + math.copysign(self.dead_zone, volts)
        return round(QUARTERS * (begin + (end - begin) * abs(volts) / self.full_voltage))

    def volts(self, target: int) -> float:
        """The command that has this pulse; 0 within the dead zone."""
        beyond = abs(target / QUARTERS - self.neutral) - self.dead_zone
        if beyond <= 0.0:
            return 0.0
        end = self.max_pulse if target > QUARTERS * self.neutral else self.min_pulse
        share = beyond / (abs(end - self.neutral) - self.dead_zone)
        return math.copysign(share * self.full_voltage, target - QUARTERS * self.neutral)


def streams(name: str, options: Options) -> tuple[Stream, ...]:
    step = MICROSECOND / QUARTERS
    pulse = Channel(
        "pulse_width", None, "s", quantum=step, description="Get Position: what the Maestro sends; 0: nothing"
    )
    flags = Channel("error_flags", None, "1", integer=True, description="Get Errors: since the row before, 0 is none")
    return (Stream(name, "maestro", (pulse, flags), 1.0 / options.rate, with_commands=True),)


def flags(value: int) -> str:
    """The names of the bits that are set."""
    known = [name for bit, name in enumerate(FLAGS) if value >> bit & 1]
    return ", ".join(known + ([f"flags {value:#06x}"] if value >> len(FLAGS) else []))
