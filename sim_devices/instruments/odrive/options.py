"""What a simulated ODrive axis is set to, and what it measures at its own terminals."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign

from sim_devices.world import World


@dataclass(frozen=True, slots=True)
class ODriveOptions:
    """`[devices.<name>]` of kind odrive."""

    kind: str
    node_id: int = 0
    firmware: str = "0.6"
    timeout: float = 0.5
    """s of the watchdog; 0: not enabled, as delivered."""
    broken_watchdog: bool = False
    """The watchdog is configured and never fires."""
    calibrated: bool = True
    """Not: it never gets into closed loop control."""
    torque_constant: float = 0.1
    """N.m/A"""
    velocity_limit: float = 60.0
    """rev/s; beyond it the set-point is cut."""
    heartbeat: float = 10.0
    """messages/s, and so of those below; 0: not sent."""
    encoder: float = 100.0
    iq: float = 50.0
    bus_voltage: float = 10.0
    temperature: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.node_id <= 62 or self.firmware not in ("0.6", "0.5"):
            raise ValueError(f"node_id 0 to 62 and firmware 0.6 or 0.5 are needed, got {self.node_id}, {self.firmware}")
        if min(self.timeout, self.heartbeat, self.encoder, self.iq, self.bus_voltage, self.temperature) < 0.0:
            raise ValueError("timeout and rates must not be negative")


@dataclass(frozen=True, slots=True)
class Measured:
    """SI: rev/s, A of the motor with the sign of the torque, A and V of the supply, degC."""

    rotation_rate: float = 0.0
    current: float = 0.0
    input_current: float = 0.0
    bus_voltage: float = 48.0
    fet_temperature: float = 25.0
    motor_temperature: float = 25.0


def measured(world: World) -> Measured:
    """The axis's view of the world now."""
    s = world.state
    current = world.sample("current")
    return Measured(
        rotation_rate=world.sample("rotation_rate"),
        current=copysign(abs(current), s.volts if s.volts != 0.0 else s.n),
        input_current=world.sample("input_current"),
        bus_voltage=world.sample("bus_voltage"),
        fet_temperature=world.sample("fet_temperature"),
        motor_temperature=world.sample("motor_temperature"),
    )
