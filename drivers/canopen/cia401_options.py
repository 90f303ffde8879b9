"""What a bench file says of an analogue output on CANopen, and the stream that follows from it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from drivers.protocols import QUARTZ, Channel, Stream

LARGEST = 32767
"""Counts of 0x6411."""


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind cia401."""

    bus: str
    """Name of the bus in the bench file."""
    node_id: int
    watchdog_timeout: float
    """s without our heartbeat after which the module stops; written to it (0x1016) and read back."""
    channel: int = 1
    """Sub-index of the output."""
    max_voltage: float = 10.0
    """V, largest |command|: what the amplifier behind the output takes."""
    counts_per_volt: float = 3276.7
    """Of 0x6411; 32767 counts for 10 V as delivered by many, but not by all."""
    offset: int = 0
    """Counts that make 0 V."""
    at_zero: Literal["brake", "coast"] = "brake"
    """What the amplifier does at a control voltage of 0; nothing on the wire tells."""
    master_id: int = 127
    """Our own node on the bus, whose heartbeat the module waits for."""
    heartbeat: float = 0.1
    """s between two heartbeats of the module."""
    timeout: float = 1.0
    """s for an answer at opening."""

    def __post_init__(self) -> None:
        for field, value in (("node_id", self.node_id), ("master_id", self.master_id)):
            if not 1 <= value <= 127:
                raise ValueError(f"cia401 {field} must be 1 to 127, not {value}")
        if self.node_id == self.master_id:
            raise ValueError(f"cia401 master_id must differ from node_id, both are {self.node_id}")
        if not 1 <= self.channel <= 254:
            raise ValueError(f"cia401 channel must be 1 to 254, not {self.channel}")
        if self.at_zero not in ("brake", "coast"):
            raise ValueError(f"cia401 at_zero must be brake or coast, not {self.at_zero!r}")
        for field, scale in (("max_voltage", self.max_voltage), ("counts_per_volt", abs(self.counts_per_volt))):
            if not 0.0 < scale < math.inf:
                raise ValueError(f"cia401 {field} must be positive, not {scale}")
        if max(abs(self.counts(self.max_voltage)), abs(self.counts(-self.max_voltage))) > LARGEST:
            raise ValueError(
                f"cia401 max_voltage of {self.max_voltage:g} V is {self.counts(self.max_voltage)} counts, more than"
                f" {LARGEST}: check counts_per_volt and offset"
            )
        if not 0.02 <= self.watchdog_timeout <= 65.0:
            raise ValueError(f"cia401 watchdog_timeout must be 0.02 to 65 s, not {self.watchdog_timeout}")
        if not (0.01 <= self.heartbeat <= 10.0 and 0.0 < self.timeout <= 60.0):
            raise ValueError(
                f"cia401 heartbeat must be 0.01 to 10 s and timeout above 0 and at most 60 s, not {self.heartbeat} and"
                f" {self.timeout}"
            )

    def counts(self, volts: float) -> int:
        """What 0x6411 is given for a control voltage."""
        return round(volts * self.counts_per_volt) + self.offset


def streams(name: str, options: Options) -> tuple[Stream, ...]:
    """What the module tells by itself: that it is there."""
    state = Channel(
        "nmt_state", None, "1", integer=True, description="5: operational, 4: stopped, 127: pre-operational"
    )
    return (Stream(name, "cia401", (state,), options.heartbeat, QUARTZ),)
