"""What a bench file says of a CANopen load cell, and the stream that follows from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from drivers.acquisition import Acquisition
from drivers.canopen.frames import Field
from drivers.force_units import NEWTONS_PER_UNIT

VALUES = {"float32": (0x6130, 32, False), "int16": (0x7130, 16, True), "int32": (0x9130, 32, True)}
"""Process value of an analogue input: index, bits, whether the integer has a sign."""
STATUS = 0x6150


@dataclass(frozen=True, slots=True)
class Options(Acquisition):
    """`[devices.<name>]` of kind cia404."""

    bus: str
    """Name of the bus in the bench file."""
    node_id: int
    rate: float
    """Rows/s; with a timer in whole milliseconds."""
    channel: int = 1
    """Sub-index of the input."""
    value: Literal["float32", "int32", "int16"] = "float32"
    """Which of its process values is sent: 0x6130, 0x9130 or 0x7130."""
    decimals: int | None = None
    """Of an integer; None: as the device says (0x6132)."""
    unit: str | None = None
    """None: as the device says (0x6131), where that is a force by its code."""
    sync: bool = False
    """The values are sent for each SYNC of ours, which goes out with the control loop, and not by a timer."""
    status: bool = True
    """Each value comes with its status (0x6150); false: the device cannot send that."""
    sign: Literal[1, -1] = 1
    """+1: the cell's positive direction is forward thrust."""
    resolution: float | None = None
    """N, one step of a float32 value."""
    range_min: float | None = None
    """N"""
    range_max: float | None = None
    """N"""
    heartbeat: float = 0.2
    """s between two heartbeats of the device."""
    timeout: float = 1.0
    """s for an answer at opening."""

    def __post_init__(self) -> None:
        if not 1 <= self.node_id <= 127:
            raise ValueError(f"cia404 node_id must be 1 to 127, not {self.node_id}")
        if not 1 <= self.channel <= 199:
            raise ValueError(f"cia404 channel must be 1 to 199, not {self.channel}")
        if self.value not in VALUES:
            raise ValueError(f"cia404 value must be one of {', '.join(VALUES)}, not {self.value!r}")
        if self.sign not in (1, -1):
            raise ValueError(f"cia404 sign must be 1 or -1, not {self.sign}")
        if not 0.1 <= self.rate <= 1000.0:
            raise ValueError(f"cia404 rate must be 0.1 to 1000/s, not {self.rate}")
        if not (0.01 <= self.heartbeat <= 60.0 and 0.0 < self.timeout <= 60.0):
            raise ValueError(
                f"cia404 heartbeat must be 0.01 to 60 s and timeout above 0 and at most 60 s, not {self.heartbeat} and"
                f" {self.timeout}"
            )
        if self.unit is not None and self.unit not in NEWTONS_PER_UNIT:
            raise ValueError(f"cia404 unit must be one of {', '.join(NEWTONS_PER_UNIT)}, not {self.unit!r}")
        if self.decimals is not None and (self.value == "float32" or not 0 <= self.decimals <= 9):
            raise ValueError(f"cia404 decimals are those of an integer value, 0 to 9, not {self.decimals}")
        self.check_acquisition("cia404")

    @property
    def period_ms(self) -> int:
        return round(1e3 / self.rate)

    @property
    def fields(self) -> tuple[Field, ...]:
        """TPDO 1."""
        index, bits, signed = VALUES[self.value]
        value = Field(index, self.channel, bits, signed)
        return (value, Field(STATUS, self.channel, 8)) if self.status else (value,)
