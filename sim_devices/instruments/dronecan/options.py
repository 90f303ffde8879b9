"""What a simulated DroneCAN ESC is set to, and what it measures at its own terminals."""

from __future__ import annotations

from dataclasses import dataclass

from sim_devices.world import World


@dataclass(frozen=True, slots=True)
class DronecanEscOptions:
    """`[devices.<name>]` of kind dronecan_esc."""

    kind: str
    node_id: int = 42
    """0: it has none, asks for one and does nothing else."""
    esc_index: int = 0
    timeout: float = 0.5
    """s after the last set-point until it stops; 0: never."""
    broken_watchdog: bool = False
    """The timeout is set and never fires."""
    reversible: bool = True
    """Not: a negative set-point stops it."""
    needs_arming: bool = False
    """It turns only while ArmingStatus says fully armed."""
    current: str = "supply"
    """Whose current it tells: `supply` or `motor`."""
    rate: float = 50.0
    """esc.Status messages/s."""
    state_rate: float = 1.0
    """NodeStatus messages/s."""
    answers: bool = True
    """It answers GetNodeInfo."""
    model: str = "org.example.esc"
    serial: str = "000102030405060708090a0b0c0d0e0f"
    """Sixteen bytes in hex."""

    def __post_init__(self) -> None:
        if not 0 <= self.node_id <= 127 or not 0 <= self.esc_index <= 19:
            raise ValueError(f"node_id 0 to 127 and esc_index 0 to 19 are needed, got {self.node_id}, {self.esc_index}")
        if min(self.timeout, self.rate, self.state_rate) < 0.0 or self.current not in ("supply", "motor"):
            raise ValueError("timeout and rates must not be negative, current must be supply or motor")
        if len(bytes.fromhex(self.serial)) != 16 or len(self.model) > 80:
            raise ValueError("serial needs 16 bytes in hex, model at most 80 characters")


@dataclass(frozen=True, slots=True)
class Measured:
    """SI: rev/s, A, V, degC."""

    rotation_rate: float = 0.0
    current: float = 0.0
    bus_voltage: float = 48.0
    temperature: float = 25.0


def measured(world: World, current: str) -> Measured:
    """The ESC's view of the world now."""
    return Measured(
        rotation_rate=world.sample("rotation_rate"),
        current=world.sample("input_current" if current == "supply" else "current"),
        bus_voltage=world.sample("bus_voltage"),
        temperature=world.sample("fet_temperature"),
    )
