"""What a simulated CiA 402 drive is set to, and what it measures at its own terminals."""

from __future__ import annotations

from dataclasses import dataclass

from sim_devices.world import World


@dataclass(frozen=True, slots=True)
class Cia402Options:
    """`[devices.<name>]` of kind cia402."""

    kind: str
    node_id: int = 5
    velocity_unit: float = 1.0
    """rev/min of the motor for one count."""
    gear_ratio: float = 1.0
    """Turns of the motor for one of the propeller."""
    rated_current: float = 20.0
    """A (0x6075)."""
    rated_torque: float = 2.0
    """N.m (0x6076)."""
    max_velocity: int = 6000
    """Counts (0x607F)."""
    acceleration: int = 30000
    """Counts/s (0x6083, 0x6084, 0x6085)."""
    broken_watchdog: bool = False
    """The heartbeat that it waits for is configured and never missed."""
    modes: int = 0x2C
    """0x6502: profile velocity, profile torque, homing."""
    keeps_mode: bool = False
    """Takes a mode (0x6060) and never enters it."""
    keeps_option: bool = False
    """Takes an abort connection option code (0x6007) and keeps its own."""
    lacks: tuple[str, ...] = ()
    """Indices of objects that it does not have, hexadecimal."""
    model: str = "SIM402"

    def __post_init__(self) -> None:
        if not 1 <= self.node_id <= 127:
            raise ValueError(f"node_id must be 1 to 127, got {self.node_id}")
        if min(self.velocity_unit, self.gear_ratio, self.rated_current, self.rated_torque, self.acceleration) <= 0:
            raise ValueError("units, gear_ratio, rated values and acceleration must be above 0")


@dataclass(frozen=True, slots=True)
class Measured:
    """SI: rev/s of the propeller, A with the sign of the torque, V."""

    rotation_rate: float = 0.0
    current: float = 0.0
    bus_voltage: float = 48.0


def measured(world: World) -> Measured:
    """The drive's view of the world now."""
    return Measured(
        rotation_rate=world.sample("rotation_rate"),
        current=world.sample("current"),
        bus_voltage=world.sample("bus_voltage"),
    )
