"""What a simulated Roboteq controller is set to, and what it measures at its own terminals."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign

from sim_devices.world import World


@dataclass(frozen=True, slots=True)
class RoboteqOptions:
    """`[devices.<name>]` of kind roboteq."""

    kind: str
    port: str
    baud: int = 115200
    watchdog: int = 1000
    """ms (RWD); 0: switched off."""
    broken_watchdog: bool = False
    """The watchdog is configured and never fires."""
    mode: int = 0
    """MMOD; 0: open loop."""
    echo: bool = True
    channels: int = 1
    """The motor is on the first."""
    pole_pairs: int = 7
    encoder_pulses: int = 100
    at_zero: str = "brake"
    """At power 0 the windings are shorted; `coast`: open."""
    ramp: float = 0.0
    """s from power 0 to the whole (from MAC and MDEC); 0: at once."""
    model: str = "SIM1360"
    firmware: str = "Roboteq v2.0 SIM1360 01/01/2020"

    def __post_init__(self) -> None:
        if self.at_zero not in ("brake", "coast"):
            raise ValueError(f"at_zero must be brake or coast, got {self.at_zero!r}")
        if not 0 <= self.watchdog <= 65000 or self.channels < 1 or self.ramp < 0.0:
            raise ValueError("0 <= watchdog <= 65000 ms, channels >= 1 and ramp >= 0 are needed")


@dataclass(frozen=True, slots=True)
class Measured:
    """SI: rev/s, A, A, V, degC. The motor's current is positive while it takes power, whatever the direction."""

    rotation_rate: float = 0.0
    current: float = 0.0
    input_current: float = 0.0
    bus_voltage: float = 48.0
    temperature: float = 25.0


def measured(world: World) -> Measured:
    """The controller's view of the world now."""
    s = world.state
    return Measured(
        rotation_rate=world.sample("rotation_rate"),
        current=world.sample("current") * copysign(1.0, s.volts if s.volts != 0.0 else s.n),
        input_current=world.sample("input_current"),
        bus_voltage=world.sample("bus_voltage"),
        temperature=world.sample("fet_temperature"),
    )
