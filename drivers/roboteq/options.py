"""What a bench file says of a Roboteq controller, and the streams that follow from it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from drivers.ports.lines import line_time
from drivers.ports.serial_port import SerialSettings
from drivers.protocols import Channel, Stream
from drivers.roboteq.lines import FULL
from drivers.roboteq.polling import characters_per_second

LONGEST_WATCHDOG = 65.0
"""s (`^RWD`)."""


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind roboteq."""

    port: str
    nominal_bus_voltage: float
    """V; power = volts / this."""
    watchdog_timeout: float
    """s, as set in the controller (`^RWD`, in ms); it is read back."""
    rotation: Literal["brushless", "encoder", "none"]
    """What the controller measures the rotation with."""
    channel: int = 1
    pole_pairs: int | None = None
    """Of a brushless motor: compared with the controller's `BPOL`; None: not compared."""
    encoder_pulses: int | None = None
    """Per revolution: compared with the controller's `EPPR`; None: not compared."""
    max_voltage: float | None = None
    """V; None: the nominal bus voltage."""
    at_zero: Literal["brake", "coast"] = "brake"
    """What the motor does at power 0; nothing on the wire tells."""
    baud: int = 115200
    rate: float = 50.0
    """Rows/s of the motor's stream; one a turn of the control loop at most."""
    state_rate: float = 5.0
    """Rows/s of faults, temperature, battery current."""
    timeout: float = 1.0
    """s for an answer at opening."""
    capture: str = ""
    """File that gets every byte with its time."""

    def __post_init__(self) -> None:
        SerialSettings(self.port, self.baud)
        if self.rotation not in ("brushless", "encoder", "none"):
            raise ValueError(f"roboteq rotation must be brushless, encoder or none, not {self.rotation!r}")
        if self.at_zero not in ("brake", "coast"):
            raise ValueError(f"roboteq at_zero must be brake or coast, not {self.at_zero!r}")
        for name, count in (
            ("channel", self.channel),
            ("pole_pairs", self.pole_pairs),
            ("encoder_pulses", self.encoder_pulses),
        ):
            if count is not None and count < 1:
                raise ValueError(f"roboteq {name} must be at least 1, not {count}")
        if not 0.0 < self.nominal_bus_voltage < math.inf:
            raise ValueError(f"roboteq nominal_bus_voltage must be positive, not {self.nominal_bus_voltage}")
        if not 0.001 <= self.watchdog_timeout <= LONGEST_WATCHDOG:
            raise ValueError(f"roboteq watchdog_timeout must be 0.001 to 65 s, not {self.watchdog_timeout}")
        if self.max_voltage is not None and not 0.0 < self.max_voltage <= self.nominal_bus_voltage:
            raise ValueError(
                f"roboteq max_voltage must be above 0 and at most nominal_bus_voltage, not {self.max_voltage}"
            )
        if not 0.0 < self.timeout <= 60.0:
            raise ValueError(f"roboteq timeout must be between 0 and 60 s, not {self.timeout}")
        self._check_line()

    def _check_line(self) -> None:
        if not (0.0 < self.rate <= 1000.0 and 0.0 < self.state_rate <= self.rate) or self.baud <= 0:
            raise ValueError(
                f"roboteq rate must be 0 to 1000/s, state_rate above 0 and at most rate, and baud above 0, not "
                f"{self.rate}, {self.state_rate} and {self.baud}"
            )
        needed = characters_per_second(self.channel, self.rotation, self.rate, self.state_rate)
        carried = 1.0 / line_time(self.baud, "8N1", 1)
        if needed > carried:
            raise ValueError(
                f"roboteq answers {needed:.0f} characters/s at rate {self.rate:g} and state_rate {self.state_rate:g},"
                f" but {self.baud} baud carries {carried:.0f}/s: lower a rate or raise baud"
            )


def streams(name: str, options: Options) -> tuple[Stream, ...]:
    speed = Channel(
        "rotation_rate", "rotation_rate", "rev/s", quantum=1.0 / 60.0, description="the controller tells whole rev/min"
    )
    motor = (
        Channel("current", "current", "A", quantum=0.1),
        Channel("power", None, "1", quantum=1.0 / FULL, description="share of the supply voltage at the motor"),
        Channel("motor_voltage", "motor_voltage", "V", description="power x measured supply voltage"),
        Channel("bus_voltage", "bus_voltage", "V", quantum=0.1),
    )
    state = (
        Channel("fault_flags", None, "1", integer=True, description="FF, 0 is none"),
        Channel("motor_flags", None, "1", integer=True, description="FM, 0 is none"),
        Channel("status_flags", None, "1", integer=True, description="FS"),
        Channel("heat_sink_temperature", None, "degC", quantum=1.0),
        Channel("input_current", None, "A", quantum=0.1),
        Channel("command_held", None, "1", integer=True, description="M, per mille: what the controller says it obeys"),
    )
    channels = motor if options.rotation == "none" else (speed, *motor)
    return (
        Stream(name, "roboteq", channels, 1.0 / options.rate),
        Stream(f"{name}_state", "roboteq", state, 1.0 / options.state_rate),
    )
