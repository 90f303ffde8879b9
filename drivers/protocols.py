"""What a device is to the rig: streams of samples in SI, and, for a motor controller, a command in volts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol, runtime_checkable

QUARTZ = 1e-4
"""Relative, 1 sigma: the clock of a device that sends by itself, quartz or ceramic resonator, over temperature."""


@dataclass(frozen=True, slots=True)
class Channel:
    """One column of a stream. `quantity`, `unit`: those of the recording format; `None` means "kept, not used"."""

    name: str
    quantity: str | None
    unit: str
    integer: bool = False
    """True for raw counts (recorded as int64)."""
    noise_std: float | None = None
    quantum: float | None = None
    """Step of the device's quantisation, in `unit`."""
    rounding: str = ""
    """`toward_zero`: the device cuts off what is beyond a step; empty: it rounds to the nearest."""
    delay: float | None = None
    """s from the quantity to the arrival of an undisturbed row: conversion, group delay of a filter, transport."""
    delay_std: float | None = None
    """s, 1 sigma: what is not known of `delay`, the same for all rows."""
    window: float | None = None
    """s that the device averages a value over, ending `delay` before its arrival."""
    low_pass: float | None = None
    """s, time constant of a first-order low pass before the window; its group delay is in `delay`."""
    filter: str = ""
    """Kind, order and corner of what else the device does to a value, in words."""
    range_min: float | None = None
    range_max: float | None = None
    calibration: str | None = None
    """JSON: how the value follows from raw counts, date, uncertainty (`gain_std`, relative, 1 sigma)."""
    description: str = ""


@dataclass(frozen=True, slots=True)
class Stream:
    """Rows that share one clock. `name` is unique on the bench: the device's name, or `<device>_<part>`."""

    name: str
    source: str
    channels: tuple[Channel, ...]
    period_s: float
    """Nominal time between rows."""
    clock_drift_std: float | None = None
    """Relative, 1 sigma: the device sends rows by a clock of its own, and its rate is known so well; None: it is asked,
    or sends when it likes."""
    with_commands: bool = False
    """Rows are asked with set-points alone: while nothing is commanded there are none."""


class Sample(NamedTuple):
    """One row of a stream: `values` in the order of the stream's channels, NaN where the device gave nothing."""

    stream: str
    t_ns: int
    """Arrival, `time.monotonic_ns()`."""
    values: tuple[float, ...]


def measured(value: float) -> float:
    """A number as it was sent; NaN for an infinite one, which no device has measured."""
    return math.nan if math.isinf(value) else value


@dataclass(frozen=True, slots=True)
class Watchdog:
    """The device's own command timeout, as configured and as read back where the device can say it."""

    timeout_s: float | None
    """None: the device has none, or nobody knows; the rig refuses to arm."""
    fed_by: str
    action: Literal["brake", "coast", "disarm"]
    resumes_by_itself: bool


@dataclass(frozen=True, slots=True)
class LinkHealth:
    """What the wire has been like. `bad` counts frames or lines not understood; the first few are kept."""

    alive: bool
    received: int
    bad: int
    first_bad: tuple[str, ...]
    error: str | None = None
    """Why the link is not alive, as one sentence."""
    dropped: int = 0
    """Records lost because nobody drained in time."""


@runtime_checkable
class Instrument(Protocol):
    """A device that measures. Constructing one opens nothing; `streams` is known before `open`."""

    name: str

    @property
    def streams(self) -> tuple[Stream, ...]: ...

    def open(self) -> str:
        """Open, identify, start streaming. Returns model and serial number. Raises LinkError or DeviceError."""

    def drain(self) -> list[Sample]:
        """All samples since the last call; never blocks, never raises."""

    def health(self) -> LinkHealth: ...

    def close(self) -> None:
        """Stop streaming and let the port go; safe to call twice and after a failure."""


@runtime_checkable
class MotorController(Instrument, Protocol):
    """An instrument that also turns the propeller."""

    @property
    def watchdog(self) -> Watchdog: ...

    @property
    def max_voltage(self) -> float:
        """Largest |command| in V that the controller can carry out."""

    def command(self, volts: float) -> None:
        """Send the set-point once. Feeds the watchdog. Raises LinkError when the wire refuses it."""

    def release(self) -> None:
        """The second way to stop, by another command than `command(0)` (current 0, disable, quick stop)."""


@runtime_checkable
class OneWay(Protocol):
    """A motor controller that drives in one direction alone: its least command is not -max_voltage."""

    @property
    def min_voltage(self) -> float:
        """V"""


@runtime_checkable
class Coarse(Protocol):
    """A motor controller whose set-points are steps: what it is told is near what it is asked for, not the same."""

    def told(self, volts: float) -> float:
        """V of the set-point that `command(volts)` sends."""


@runtime_checkable
class Paced(Protocol):
    """A motor controller that takes fewer set-points a second than it may be given: between two it keeps the first."""

    @property
    def holds(self) -> float:
        """V of the last set-point that went to it."""


@runtime_checkable
class ForceSensor(Instrument, Protocol):
    """An instrument whose first stream has a `thrust` channel."""

    def tare(self) -> None:
        """Zero inside the instrument. A campaign tares by subtraction; `rig calibrate` asks for this where its plan
        says so: for a cell whose hook takes it near the end of its range. Raises LinkError, DeviceError when refused.
        """
