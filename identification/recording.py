"""A recording in memory: read-only arrays, each channel on its own clock. `rig.hdf5.load` returns it, fits take it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

QUANTITY_UNITS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "command_voltage": ("V",),
        "motor_voltage": ("V",),
        "bus_voltage": ("V",),
        "current": ("A",),
        "rotation_rate": ("rev/s",),
        "thrust": ("N",),
        "torque": ("N.m",),
        "flow_speed": ("m/s",),
        "water_temperature": ("degC",),
        "motor_temperature": ("degC",),
        "depth": ("m",),
        "position": ("m",),
        "heading": ("rad",),
        "speed": ("m/s", "rad/s"),
        "acceleration": ("m/s^2",),
        "emergency_stop": ("1",),
    }
)
"""Quantities of recording-format.md and the units each may have."""


def _frozen(array: Floats) -> Floats:
    out = np.ascontiguousarray(array, dtype=np.float64)
    if out is array:
        out = out.copy()
    out.flags.writeable = False
    return out


@dataclass(frozen=True, slots=True)
class Acquisition:
    """How values came to be and to be stamped, where a recording says so (recording-format.md); None: it does not."""

    delay: float | None = None
    """s from the quantity to its stamp: conversion, group delay of a filter, transport."""
    delay_std: float | None = None
    """s."""
    window: float | None = None
    """s that a value is averaged over, ending `delay` before its stamp."""
    low_pass: float | None = None
    """s, time constant of a first-order low pass that the value went through before the window; its group delay, the
    same at low frequencies, is in `delay`."""
    quantum: float | None = None
    """Step of the values, in the channel's unit."""
    rounding: str = ""
    """How a value comes to a step: `toward_zero` where the device cuts what is beyond it off; empty: to the nearest."""
    hold: float | None = None
    """s for which a slow device repeats a value at a faster rate."""
    filter: str = ""
    """Kind, order, corner."""
    period: float | None = None
    """s between two rows by the device's own clock, which the whole stream has."""
    clock_drift_std: float | None = None
    """Of that clock against the run's, relative."""


def calibration_text(stream: str, channel: str, facts: Mapping[str, object]) -> str:
    """A cell and the facts of its calibration as one text; its role in the recording is no part of it.

    >>> calibration_text("cell", "thrust", {"gain_std": 0.1, "role": "primary"})
    'cell/thrust {"gain_std": 0.1}'
    """
    known = {key: value for key, value in facts.items() if key != "role"}
    return f"{stream}/{channel} {json.dumps(known, sort_keys=True, default=str)}"


@dataclass(frozen=True, eq=False)
class Channel:
    """One measured quantity on its own clock.

    `time` (n,) s since the start of the run, non-decreasing; `value` (n,) in `unit`, NaN where the device gave nothing.
    """

    name: str
    stream: str
    quantity: str | None
    unit: str
    time: Floats
    value: Floats
    noise_std: float | None = None
    range_min: float | None = None
    range_max: float | None = None
    calibration: Mapping[str, object] = field(default_factory=dict)
    thruster: str | None = None
    axis: str | None = None
    description: str = ""
    acquisition: Acquisition = field(default_factory=Acquisition)

    def __post_init__(self) -> None:
        object.__setattr__(self, "time", _frozen(self.time))
        object.__setattr__(self, "value", _frozen(self.value))
        if self.time.ndim != 1 or self.time.shape != self.value.shape:
            raise ValueError(
                f"channel {self.stream}/{self.name}: time {self.time.shape} and value {self.value.shape} must be two "
                "one-dimensional arrays of the same length"
            )
        if self.time.size > 1 and not np.all(np.diff(self.time) >= 0):
            raise ValueError(f"channel {self.stream}/{self.name}: time must be finite and must not run backwards")

    def held_at(self, times: Floats) -> Floats:
        """Value of the latest row at or before each time (zero-order hold); NaN before the first row."""
        if self.time.size == 0:
            return np.full(np.shape(times), np.nan)
        index = np.searchsorted(self.time, times, side="right") - 1
        out: Floats = np.where(index >= 0, self.value[np.maximum(index, 0)], np.nan)
        return out

    def window(self, t_start: float, t_end: float) -> tuple[Floats, Floats]:
        """Times and values with t_start <= time < t_end; NaN values are left in."""
        low, high = np.searchsorted(self.time, (t_start, t_end), side="left")
        return self.time[low:high], self.value[low:high]


VOID = "void"
"""Phase of a row that marks the time of another row as bad: an operator saw that something was wrong then."""


@dataclass(frozen=True)
class Step:
    """One step as it was really run."""

    index: int
    phase: str
    """`tare`, `ramp`, `hold`, `rest`, `sine` or `free`; in a file also VOID."""
    command_voltage: float
    t_start: float
    t_end: float


@dataclass(frozen=True)
class Event:
    """Something that happened `time` s after the run began, as the journal has it."""

    time: float
    level: str
    text: str


@dataclass(frozen=True, eq=False)
class Recording:
    """One run of one thruster, or one trial of a vehicle. Absent optional facts are empty strings or None."""

    recording_id: str
    thruster: str
    channels: tuple[Channel, ...]
    steps: tuple[Step, ...] = ()
    events: tuple[Event, ...] = ()
    kind: str = "tunnel"
    created: str = ""
    complete: bool = True
    outcome: str = ""
    cause: str = ""
    water_density: float | None = None
    source: str = ""
    """Where it came from (a file name), for messages."""
    attributes: Mapping[str, object] = field(default_factory=dict)

    def all_of(self, quantity: str) -> tuple[Channel, ...]:
        return tuple(channel for channel in self.channels if channel.quantity == quantity)

    def first_of(self, quantity: str) -> Channel | None:
        """The channel of that quantity; of several thrust cells the one whose calibration has role `primary`."""
        found = self.all_of(quantity)
        primary = [channel for channel in found if channel.calibration.get("role") == "primary"]
        return next(iter(primary or found), None)

    @cached_property
    def duration(self) -> float:
        """Seconds from the first to the last row of any channel."""
        ends = [(c.time[0], c.time[-1]) for c in self.channels if c.time.size]
        return float(max(e for _, e in ends) - min(s for s, _ in ends)) if ends else 0.0
