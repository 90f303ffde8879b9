"""What a bench file says of a SCPI supply, and the stream that follows from it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from drivers.ports.lines import line_time
from drivers.ports.serial_port import SerialSettings
from drivers.protocols import Channel, Stream
from drivers.scpi.lines import encode, setting

COMMANDS = len("VOLT 12.345\n")
QUESTIONS = len("MEAS:VOLT?\nMEAS:CURR?\n")
ANSWER = len("+1.23456789E+01\r\n")


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind scpi_supply."""

    port: str
    max_voltage: float
    """V, largest command; the supply gives none below 0."""
    current_limit: float
    """A: CURR, set and read back."""
    watchdog_timeout: float | None = None
    """s of the supply's own watchdog; None: it has none, and the rig does not arm it."""
    watchdog_settings: tuple[str, ...] = ()
    """Commands that set and start it, such as `OUTP:PROT:WDOG:DEL 1`; each is read back."""
    over_voltage: float | None = None
    """V: VOLT:PROT, set and read back; None: as it is set."""
    protection_clear: str = ""
    """Command that ends what the watchdog latched, such as `OUTP:PROT:CLE`."""
    remote: str = ""
    """Command that takes the supply into remote control, such as `SYST:REM`."""
    resolution: float = 0.001
    """V, one digit of VOLT."""
    command_rate: float = 20.0
    """Set-points/s at most; 0 V is sent at once."""
    rate: float = 5.0
    """Rows/s of voltage and current, while set-points are sent."""
    baud: int = 9600
    framing: str = "8N1"
    timeout: float = 1.0
    """s for an answer."""
    capture: str = ""
    """File that gets every byte with its time."""

    def __post_init__(self) -> None:
        SerialSettings(self.port, self.baud, self.framing)
        positive = {
            "max_voltage": self.max_voltage, "current_limit": self.current_limit, "resolution": self.resolution,
            "command_rate": self.command_rate, "rate": self.rate,
        }  # fmt: skip
        for key, value in positive.items():
            if not 0.0 < value < math.inf:
                raise ValueError(f"scpi_supply {key} must be positive, not {value}")
        if self.over_voltage is not None and not self.max_voltage < self.over_voltage < math.inf:
            raise ValueError(f"scpi_supply over_voltage must be above max_voltage, not {self.over_voltage}")
        self._check_watchdog()
        for command in (self.protection_clear, self.remote):
            if command:
                encode(command)
        if not 0.0 < self.timeout <= 60.0:
            raise ValueError(f"scpi_supply timeout must be between 0 and 60 s, not {self.timeout}")
        needed = self.command_rate * COMMANDS + self.rate * (QUESTIONS + 2 * ANSWER)
        if self.baud <= 0 or needed > 1.0 / line_time(self.baud, self.framing, 1):
            raise ValueError(
                f"scpi_supply needs {needed:.0f} characters/s at command_rate {self.command_rate:g} and rate"
                f" {self.rate:g}, more than {self.baud} baud carries: lower a rate or raise baud"
            )

    def _check_watchdog(self) -> None:
        timeout = self.watchdog_timeout
        if timeout is None:
            if self.watchdog_settings:
                raise ValueError("scpi_supply watchdog_settings need watchdog_timeout, the time that they set")
            return
        if not 2.0 / self.command_rate <= timeout < math.inf:
            raise ValueError(
                f"scpi_supply watchdog_timeout must be at least two set-points ({2.0 / self.command_rate:g} s),"
                f" not {timeout}"
            )
        for command in self.watchdog_settings:
            setting(command)


def stream(name: str, options: Options) -> Stream:
    channels = (
        Channel("motor_voltage", "motor_voltage", "V", description="MEAS:VOLT?, at the supply's terminals"),
        Channel("current", "current", "A", description="MEAS:CURR?"),
    )
    return Stream(name, "scpi_supply", channels, 1.0 / options.rate, with_commands=True)
