"""What a bench file says of an ODrive axis, and the streams that follow from it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from drivers.protocols import QUARTZ, Channel, Stream


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind odrive_can."""

    bus: str
    node_id: int
    max_voltage: float
    """V, largest |command|."""
    watchdog_timeout: float
    """s, as set in the axis (`config.watchdog_timeout`, with `enable_watchdog`); it cannot be asked over CANSimple."""
    mode: Literal["velocity", "torque"] = "velocity"
    rate_per_volt: float | None = None
    """rev/s of the axis for a command of 1 V (mode velocity)."""
    torque_per_volt: float | None = None
    """N.m of the axis for a command of 1 V (mode torque)."""
    firmware: Literal["0.6", "0.5"] = "0.6"
    """Whose heartbeat and errors are understood."""
    rate: float = 100.0
    """Encoder estimates/s (`encoder_msg_rate_ms`)."""
    current_rate: float = 50.0
    """Iq messages/s (`iq_msg_rate_ms`); 0: not sent, then no current is measured."""
    supply_rate: float = 10.0
    """Bus voltage messages/s (`bus_voltage_msg_rate_ms`); 0: not sent."""
    thermal_rate: float = 0.0
    """Temperature messages/s (`temperature_msg_rate_ms`); 0: not sent."""
    heartbeat_rate: float = 10.0
    """Heartbeats/s (`heartbeat_msg_rate_ms`)."""

    def __post_init__(self) -> None:
        if not 0 <= self.node_id <= 62:
            raise ValueError(f"odrive_can node_id must be 0 to 62, not {self.node_id}")
        for key, value in (("max_voltage", self.max_voltage), ("watchdog_timeout", self.watchdog_timeout)):
            if not 0.0 < value < math.inf:
                raise ValueError(f"odrive_can {key} must be positive, not {value}")
        if self.firmware not in ("0.6", "0.5"):
            raise ValueError(f"odrive_can firmware must be 0.6 or 0.5, not {self.firmware!r}")
        self._check_scale()
        optional = (self.current_rate, self.supply_rate, self.thermal_rate)
        if not all(0.0 < rate <= 1000.0 for rate in (self.rate, self.heartbeat_rate)) or not all(
            0.0 <= rate <= 1000.0 for rate in optional
        ):
            raise ValueError("odrive_can rates must be 0 to 1000 messages/s, rate and heartbeat_rate above 0")

    def _check_scale(self) -> None:
        if self.mode not in ("velocity", "torque"):
            raise ValueError(f"odrive_can mode must be velocity or torque, not {self.mode!r}")
        wanted, other = ("rate_per_volt", "torque_per_volt")[:: 1 if self.mode == "velocity" else -1]
        scale = getattr(self, wanted)
        if scale is None or not math.isfinite(scale) or scale == 0.0:
            raise ValueError(f"odrive_can mode {self.mode} needs {wanted}, finite and not 0, not {scale}")
        if getattr(self, other) is not None:
            raise ValueError(f"odrive_can {other} has no meaning in mode {self.mode}: leave it out")

    @property
    def per_volt(self) -> float:
        """rev/s or N.m."""
        scale = self.rate_per_volt if self.mode == "velocity" else self.torque_per_volt
        return 0.0 if scale is None else scale


def streams(name: str, options: Options) -> tuple[Stream, ...]:
    motor = (
        Channel("rotation_rate", "rotation_rate", "rev/s", description="the axis's own estimate (encoder, filtered)"),
        Channel("position", None, "1", description="turns"),
    )
    current = (Channel("current", "current", "A", description="Iq"), Channel("current_setpoint", None, "A"))
    supply = (Channel("bus_voltage", "bus_voltage", "V"), Channel("input_current", None, "A"))
    thermal = (Channel("fet_temperature", None, "degC"), Channel("motor_temperature", "motor_temperature", "degC"))
    state = (
        Channel("axis_error", None, "1", integer=True, description="bits, 0 is none"),
        Channel("axis_state", None, "1", integer=True, description="1 idle, 8 closed loop control"),
    )
    parts = (
        ("", options.rate, motor),
        ("_current", options.current_rate, current),
        ("_supply", options.supply_rate, supply),
        ("_thermal", options.thermal_rate, thermal),
        ("_state", options.heartbeat_rate, state),
    )
    return tuple(
        Stream(name + part, "odrive_can", channels, 1.0 / rate, QUARTZ) for part, rate, channels in parts if rate
    )
