"""What a bench file says of a CiA 402 drive, and the streams that follow from it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from drivers.canopen.frames import Field
from drivers.protocols import QUARTZ, Channel, Stream

STATUSWORD, VELOCITY, CURRENT = Field(0x6041, 0, 16), Field(0x606C, 0, 32, True), Field(0x6078, 0, 16, True)
MODE_SHOWN, BUS_VOLTAGE, TORQUE = Field(0x6061, 0, 8, True), Field(0x6079, 0, 32), Field(0x6077, 0, 16, True)
CONTROLWORD, TARGET_VELOCITY, TARGET_TORQUE = (
    Field(0x6040, 0, 16),
    Field(0x60FF, 0, 32, True),
    Field(0x6071, 0, 16, True),
)
MODES = {"velocity": 3, "torque": 4}
"""0x6060: profile velocity, profile torque."""
ON_SILENCE = {"fault": 1, "coast": 2, "quick_stop": 3}
"""0x6007, abort connection option code."""


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind cia402."""

    bus: str
    """Name of the bus in the bench file."""
    node_id: int
    max_voltage: float
    """V, largest |command|."""
    watchdog_timeout: float
    """s without our heartbeat after which the drive stops; written to the drive (0x1016) and read back."""
    mode: Literal["velocity", "torque"] = "velocity"
    rate_per_volt: float | None = None
    """rev/s of the propeller for a command of 1 V (mode velocity)."""
    torque_per_volt: float | None = None
    """N.m of the motor for a command of 1 V (mode torque)."""
    velocity_unit: float = 1.0
    """rev/min of the motor for one count of 0x606C and 0x60FF; compared with 0x60A9 where the drive has it."""
    gear_ratio: float = 1.0
    """Turns of the motor for one of the propeller."""
    rated_current: float | None = None
    """A, compared with 0x6075; None: the drive measures no current that is asked for."""
    rated_torque: float | None = None
    """N.m, compared with 0x6076; None: no torque is asked for."""
    bus_voltage_unit: float = 0.001
    """V for one count of 0x6079; 0: it is not asked for."""
    on_silence: Literal["quick_stop", "coast", "fault"] = "quick_stop"
    """What the drive does when our heartbeat stops: 0x6007."""
    quick_stop_option: int = 2
    """0x605A: 1 slows down on the deceleration ramp, 2 on that of the quick stop, then the power stage is off."""
    acceleration: float | None = None
    """rev/s^2 of the propeller, written to 0x6083 and 0x6084; None: they stay as they are."""
    quick_stop_deceleration: float | None = None
    """rev/s^2 of the propeller, written to 0x6085; None: it stays as it is."""
    idle_time: float = 30.0
    """s of commands of 0 V after which the motor gets no torque until the next set-point."""
    reset_faults: bool = False
    """Reset at opening a fault that is not our own silence's."""
    master_id: int = 127
    """Our own node on the bus, whose heartbeat the drive waits for."""
    rate: float = 50.0
    """Rows/s of rotation rate and current."""
    state_rate: float = 10.0
    """Rows/s of mode, supply voltage, torque; and heartbeats/s of the drive."""
    timeout: float = 1.0
    """s for an answer at opening."""

    def __post_init__(self) -> None:
        for field, value in (("node_id", self.node_id), ("master_id", self.master_id)):
            if not 1 <= value <= 127:
                raise ValueError(f"cia402 {field} must be 1 to 127, not {value}")
        if self.node_id == self.master_id:
            raise ValueError(f"cia402 master_id must differ from node_id, both are {self.node_id}")
        for key, chosen, known in (("mode", self.mode, MODES), ("on_silence", self.on_silence, ON_SILENCE)):
            if chosen not in known:
                raise ValueError(f"cia402 {key} must be one of {', '.join(known)}, not {chosen!r}")
        if self.quick_stop_option not in (1, 2):
            raise ValueError(
                f"cia402 quick_stop_option must be 1 or 2, which end with the power stage off, not"
                f" {self.quick_stop_option}"
            )
        self._check_scales()
        self._check_times()

    def _check_scales(self) -> None:
        wanted, other = ("rate_per_volt", "torque_per_volt")[:: 1 if self.mode == "velocity" else -1]
        if getattr(self, wanted) is None or getattr(self, other) is not None:
            raise ValueError(f"cia402 in mode {self.mode} needs {wanted}, and no {other}")
        if self.mode == "torque" and self.rated_torque is None:
            raise ValueError("cia402 in mode torque needs rated_torque: its set-points are thousandths of it")
        for key in (
            "max_voltage",
            "rate_per_volt",
            "torque_per_volt",
            "velocity_unit",
            "gear_ratio",
            "rated_current",
            "rated_torque",
            "acceleration",
            "quick_stop_deceleration",
        ):
            value = getattr(self, key)
            if value is not None and not 0.0 < value < math.inf:
                raise ValueError(f"cia402 {key} must be positive, not {value}")
        if not 0.0 <= self.bus_voltage_unit < math.inf:
            raise ValueError(f"cia402 bus_voltage_unit must be positive, or 0 without one, not {self.bus_voltage_unit}")
        bits = (TARGET_VELOCITY if self.mode == "velocity" else TARGET_TORQUE).bits
        if abs(self.counts(self.max_voltage)) >= 1 << bits - 1:
            raise ValueError(
                f"cia402 max_voltage of {self.max_voltage:g} V is {self.counts(self.max_voltage)} counts, more than"
                f" {bits} bits carry: check {wanted} and the units"
            )

    def _check_times(self) -> None:
        if not 0.02 <= self.watchdog_timeout <= 65.0:
            raise ValueError(f"cia402 watchdog_timeout must be 0.02 to 65 s, not {self.watchdog_timeout}")
        if not (0.1 <= self.state_rate <= self.rate <= 1000.0):
            raise ValueError(
                "cia402 rate must be at most 1000/s and state_rate 0.1/s to rate, not"
                f" {self.rate} and {self.state_rate}"
            )
        if not self.idle_time > 0.0:
            raise ValueError(f"cia402 idle_time must be positive, inf for never, not {self.idle_time}")
        if not 0.0 < self.timeout <= 60.0:
            raise ValueError(f"cia402 timeout must be between 0 and 60 s, not {self.timeout}")

    @property
    def period_ms(self) -> int:
        """Between two rows of the motor; event timers count milliseconds."""
        return round(1e3 / self.rate)

    @property
    def state_period_ms(self) -> int:
        return round(1e3 / self.state_rate)

    @property
    def rate_per_count(self) -> float:
        """rev/s of the propeller for one count of velocity."""
        return self.velocity_unit / 60.0 / self.gear_ratio

    def counts(self, volts: float) -> int:
        """The set-point of a command: counts of velocity, or thousandths of the rated torque."""
        if self.rate_per_volt is not None:
            return round(volts * self.rate_per_volt / self.rate_per_count)
        return round(1e3 * volts * (self.torque_per_volt or 0.0) / (self.rated_torque or math.inf))

    def volts(self, counts: int) -> float:
        """Of the command that is this set-point."""
        if self.rate_per_volt is not None:
            return counts * self.rate_per_count / self.rate_per_volt
        return counts * (self.rated_torque or 0.0) / (1e3 * (self.torque_per_volt or math.inf))

    @property
    def motor_fields(self) -> tuple[Field, ...]:
        """TPDO 1."""
        return (STATUSWORD, VELOCITY) if self.rated_current is None else (STATUSWORD, VELOCITY, CURRENT)

    @property
    def state_fields(self) -> tuple[Field, ...]:
        """TPDO 2."""
        volts = (BUS_VOLTAGE,) if self.bus_voltage_unit else ()
        torque = () if self.rated_torque is None else (TORQUE,)
        return (MODE_SHOWN, *volts, *torque)


def streams(name: str, options: Options) -> tuple[Stream, ...]:
    speed = Channel(
        "rotation_rate",
        "rotation_rate",
        "rev/s",
        quantum=options.rate_per_count,
        description="0x606C x velocity_unit / 60 / gear_ratio",
    )
    current = Channel(
        "current",
        "current",
        "A",
        quantum=1e-3 * (options.rated_current or 0.0),
        description="0x6078 x rated current / 1000, positive while it drives",
    )
    status = Channel("statusword", None, "1", integer=True, description="0x6041")
    mode = Channel("mode", None, "1", integer=True, description="0x6061")
    volts = Channel("bus_voltage", "bus_voltage", "V", quantum=options.bus_voltage_unit or None)
    torque = Channel("motor_torque", None, "N.m", quantum=1e-3 * (options.rated_torque or 0.0), description="0x6077")
    motor = (speed, status) if options.rated_current is None else (speed, status, current)
    state = [mode]
    state += [volts] if options.bus_voltage_unit else []
    state += [] if options.rated_torque is None else [torque]
    return (
        Stream(name, "cia402", motor, 1e-3 * options.period_ms, QUARTZ),
        Stream(f"{name}_state", "cia402", tuple(state), 1e-3 * options.state_period_ms, QUARTZ),
    )
