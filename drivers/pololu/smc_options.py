"""What a bench file says of a Pololu Simple Motor Controller G2, its variables, and the stream. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from drivers.pololu.packets import Packets
from drivers.ports.lines import check_line_rate
from drivers.ports.serial_port import SerialSettings
from drivers.protocols import Channel, Stream

FULL = 3200
"""Speed of the whole supply voltage (0J77, 6.2.1)."""
ERROR_STATUS, ERRORS_OCCURRED, SPEED, INPUT_VOLTAGE, TEMPERATURE = 0, 1, 21, 23, 24
"""Variables (0J77, 6.4): errors that stop the motor now; those since it was last read; -3200 to 3200; mV; 0.1 degC."""
ERRORS = (
    "safe start violation",
    "required channel invalid",
    "serial error",
    "command timeout",
    "limit or kill switch",
    "low supply voltage",
    "high supply voltage",
    "over temperature",
    "motor driver error",
    "ERR line high",
)
"""Bits of both, from bit 0."""
SAFE_START, COMMAND_TIMEOUT = 1 << 0, 1 << 3
LONGEST_TIMEOUT = 655.35
"""s"""


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind smc_g2."""

    port: str
    nominal_bus_voltage: float
    """V; speed = 3200 volts / this."""
    watchdog_timeout: float
    """s, command timeout as set in the controller; it is measured at opening."""
    max_voltage: float | None = None
    """V; None: the nominal bus voltage."""
    at_zero: Literal["brake", "coast"] = "coast"
    """What the motor does at speed 0; nothing that is asked tells."""
    current_variable: int | None = 46
    """Number of the variable that is the current in mA; None: this model measures none."""
    protocol: Literal["compact", "pololu"] = "compact"
    device_number: int = 13
    """In the Pololu protocol."""
    crc: bool = False
    """For commands, as set in the controller."""
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
                raise ValueError(f"smc_g2 {key} must be {' or '.join(choices)}, not {value!r}")
        for key, number in (("device_number", self.device_number), ("current_variable", self.current_variable)):
            if number is not None and not 0 <= number <= 127:
                raise ValueError(f"smc_g2 {key} must be 0 to 127, not {number}")
        if not 0.0 < self.nominal_bus_voltage < math.inf:
            raise ValueError(f"smc_g2 nominal_bus_voltage must be positive, not {self.nominal_bus_voltage}")
        if not 0.05 <= self.watchdog_timeout <= LONGEST_TIMEOUT:
            raise ValueError(
                f"smc_g2 watchdog_timeout must be 0.05 to {LONGEST_TIMEOUT:g} s, not {self.watchdog_timeout}"
            )
        if self.max_voltage is not None and not 0.0 < self.max_voltage <= self.nominal_bus_voltage:
            raise ValueError(
                f"smc_g2 max_voltage must be above 0 and at most nominal_bus_voltage, not {self.max_voltage}"
            )
        if not 0.0 < self.timeout <= 60.0:
            raise ValueError(f"smc_g2 timeout must be between 0 and 60 s, not {self.timeout}")
        check_line_rate("smc_g2", self.rate, self.baud, "8N1", 2 * len(self.variables) * 6)

    @property
    def packets(self) -> Packets:
        return Packets(self.device_number if self.protocol == "pololu" else None, self.crc)

    @property
    def variables(self) -> tuple[int, ...]:
        """Of a row, in the order in which they are asked; the errors last, so that nothing later is left out."""
        current = () if self.current_variable is None else (self.current_variable,)
        return (SPEED, INPUT_VOLTAGE, TEMPERATURE, *current, ERROR_STATUS, ERRORS_OCCURRED)


def streams(name: str, options: Options) -> tuple[Stream, ...]:
    amps = (Channel("current", "current", "A", quantum=0.001, description="the controller's own, coarse at low power"),)
    channels = (
        Channel("power", None, "1", quantum=1.0 / FULL, description="share of the supply voltage at the motor"),
        Channel("motor_voltage", "motor_voltage", "V", description="power x measured supply voltage"),
        Channel("bus_voltage", "bus_voltage", "V", quantum=0.001),
        *(amps if options.current_variable is not None else ()),
        Channel("board_temperature", None, "degC", quantum=0.1),
        Channel("error_flags", None, "1", integer=True, description="errors that stop the motor now, 0 is none"),
    )
    return (Stream(name, "smc_g2", channels, 1.0 / options.rate, with_commands=True),)


def errors(value: int) -> str:
    """The names of the bits that are set."""
    known = [name for bit, name in enumerate(ERRORS) if value >> bit & 1]
    return ", ".join(known + ([f"errors {value:#06x}"] if value >> len(ERRORS) else []))


def signed(word: int) -> int:
    """A number of 16 bits in two's complement."""
    return word - 0x10000 if word & 0x8000 else word
