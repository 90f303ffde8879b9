"""All that crosses between the controller and the recorder process. No h5py here: the controller imports this file.

One run: Open -> Ready; then Rows, StepRow, EventRow in any order, an Ack after each flush; Close -> Closed.
Failed in place of Ready means that no file was opened; Failed at any other time, that the recorder has ended.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Attribute = str | bool | int | float
"""A root attribute of a recording."""

Outcome = Literal["completed", "aborted", "tripped"]


@dataclass(frozen=True, slots=True)
class ChannelSpec:
    """One dataset of a stream: its attributes in the recording format; empty or None is not written."""

    name: str
    quantity: str | None
    unit: str
    integer: bool = False
    """True: int64 raw counts. A row without a count is written as `missing_value`, an attribute of the dataset."""
    noise_std: float | None = None
    quantum: float | None = None
    rounding: str = ""
    delay: float | None = None
    """s, as `delay_std`, `window` and `low_pass`."""
    delay_std: float | None = None
    window: float | None = None
    low_pass: float | None = None
    filter: str = ""
    range_min: float | None = None
    range_max: float | None = None
    calibration: str | None = None
    """JSON text; of several thrust cells the modelled one has `"role": "primary"`."""
    thruster: str = ""
    axis: str = ""
    description: str = ""


@dataclass(frozen=True, slots=True)
class StreamSpec:
    """One group under /streams: rows that share one clock."""

    name: str
    source: str
    channels: tuple[ChannelSpec, ...]
    device_id: str = ""
    note: str = ""
    period: float | None = None
    """s between rows by the device's own clock; written only with `clock_drift_std`."""
    clock_drift_std: float | None = None


@dataclass(frozen=True, slots=True)
class Open:
    """Create a recording. The layout is complete with this message: nothing can be added later."""

    path: str
    """Must not exist yet."""
    t0_ns: int
    """`time.monotonic_ns()` of t = 0."""
    streams: tuple[StreamSpec, ...]
    attributes: dict[str, Attribute] = field(default_factory=dict)
    """Root attributes besides `format`, `format_version`, `complete` and `outcome`, which the writer sets."""
    expected_bytes: int = 0
    """Size the plan predicts; refused when less than twice that is free."""


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Rows of one stream of the open file: `t_ns` (n,) monotonic ns; `values` (n, channels), NaN = nothing came."""

    stream: int
    """Index into `Open.streams`."""
    t_ns: NDArray[np.int64]
    values: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class StepRow:
    """A step as it was really run; times in s since t0."""

    index: int
    phase: str
    command_voltage: float
    t_start: float
    t_end: float


@dataclass(frozen=True, slots=True)
class EventRow:
    """What an analyst needs to know; time in s since t0. A long text becomes several rows."""

    time: float
    level: Literal["info", "warning", "trip", "error"]
    text: str


@dataclass(frozen=True, slots=True)
class Close:
    """The run has ended so: the recorder writes that and closes the file."""

    outcome: Outcome
    cause: str = ""


@dataclass(frozen=True, slots=True)
class Ready:
    """The file exists with its whole layout and takes rows."""

    path: str


@dataclass(frozen=True, slots=True)
class Ack:
    """After each flush, four times a second while a file is open, whether or not rows came."""

    rows: tuple[int, ...]
    """Rows on disk per stream, in the order of `Open.streams`."""
    time: float
    """s since t0 when the flush ended (the recorder's own monotonic clock, which is the machine's)."""
    free_bytes: int
    """Left on the file system: the controller ends the run in order before there is none."""


@dataclass(frozen=True, slots=True)
class Closed:
    """The file is whole, and on disk."""

    path: str
    sha256: str
    """Of the closed file, hexadecimal: results name the recording by it."""


@dataclass(frozen=True, slots=True)
class Failed:
    """The recorder cannot go on, and why."""

    text: str
