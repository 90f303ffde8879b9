"""What a bench file says of a DroneCAN ESC, and the streams that follow from it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from drivers.protocols import QUARTZ, Channel, Stream

HEALTH = ("ok", "warning", "error", "critical")
MODES = {0: "operational", 1: "in initialization", 2: "in maintenance", 3: "in a software update", 7: "offline"}
"""Of a NodeStatus (341.NodeStatus.uavcan)."""
LARGEST_INDEX = 19
"""RawCommand has at most 20 set-points (1030.RawCommand.uavcan)."""


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind dronecan_esc."""

    bus: str
    node_id: int
    max_voltage: float
    """V, largest |command|."""
    full_voltage: float
    """V for which RawCommand 8191, all that the ESC gives, is sent: the supply's, as a rule."""
    watchdog_timeout: float
    """s after the last RawCommand until the ESC stops by itself, as set in the ESC; nothing in the protocol asks it."""
    esc_index: int = 0
    """Place of its set-point in RawCommand, and what its Status says."""
    reversible: bool = False
    """The ESC takes negative set-points as the other direction; otherwise a negative command is refused."""
    arming: bool = False
    """ArmingStatus goes out with the commands, for an ESC that asks for it."""
    own_node_id: int = 10
    """Of the rig."""
    current: Literal["supply", "motor"] = "supply"
    """Whose current the ESC tells; the protocol leaves it open."""
    rate: float = 50.0
    """esc.Status messages/s."""
    state_rate: float = 1.0
    """NodeStatus messages/s; at least 1 by the protocol."""

    def __post_init__(self) -> None:
        for key, node in (("node_id", self.node_id), ("own_node_id", self.own_node_id)):
            if not 1 <= node <= 127:
                raise ValueError(f"dronecan_esc {key} must be 1 to 127, not {node}")
        if self.node_id == self.own_node_id:
            raise ValueError(f"dronecan_esc node_id and own_node_id must differ, both are {self.node_id}")
        if not 0 <= self.esc_index <= LARGEST_INDEX:
            raise ValueError(f"dronecan_esc esc_index must be 0 to {LARGEST_INDEX}, not {self.esc_index}")
        positive = {
            "max_voltage": self.max_voltage, "full_voltage": self.full_voltage,
            "watchdog_timeout": self.watchdog_timeout,
        }  # fmt: skip
        for key, value in positive.items():
            if not 0.0 < value < math.inf:
                raise ValueError(f"dronecan_esc {key} must be positive, not {value}")
        if self.max_voltage > self.full_voltage:
            raise ValueError(
                f"dronecan_esc max_voltage must be at most full_voltage ({self.full_voltage:g}), not {self.max_voltage}"
            )
        if self.current not in ("supply", "motor"):
            raise ValueError(f"dronecan_esc current must be supply or motor, not {self.current!r}")
        if not 0.0 < self.rate <= 1000.0 or not 1.0 <= self.state_rate <= 500.0:
            raise ValueError("dronecan_esc rate must be above 0 to 1000 messages/s, state_rate 1 to 500")


def streams(name: str, options: Options) -> tuple[Stream, ...]:
    current = (
        Channel("current", "current", "A", description="of the motor, as the ESC tells it (float16)")
        if options.current == "motor"
        else Channel("input_current", None, "A", description="of the supply, as the ESC tells it (float16)")
    )
    status = (
        Channel("rotation_rate", "rotation_rate", "rev/s", quantum=1.0 / 60.0, description="whole rev/min"),
        Channel("bus_voltage", "bus_voltage", "V", description="float16"),
        current,
        Channel("esc_temperature", None, "degC", description="float16, in K on the bus"),
        Channel("power_rating", None, "1", description="of the most it can, 0 to 1.27"),
        Channel("error_count", None, "1", integer=True, description="since the motor's start, as the ESC counts"),
    )
    state = (
        Channel("health", None, "1", integer=True, description="0 ok, 1 warning, 2 error, 3 critical"),
        Channel("mode", None, "1", integer=True, description="0 operational"),
        Channel("uptime", None, "s", integer=True),
        Channel("vendor_status", None, "1", integer=True, description="as the maker defines it"),
    )
    return (
        Stream(name, "dronecan_esc", status, 1.0 / options.rate, QUARTZ),
        Stream(f"{name}_state", "dronecan_esc", state, 1.0 / options.state_rate, QUARTZ),
    )
