"""All that crosses between the controller and the watcher process, beside Rows and Failed of recorder_messages.

One run: Watched, then Rows whose `stream` is an index into `Watched.streams`; a Mismatch may come at any time. The next
Watched begins another run. Judged comes after each stretch that was looked at. Failed: this run is not watched, or not
any more.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class WatchedStream:
    """Rows that share one clock."""

    name: str
    columns: tuple[tuple[int, str], ...]
    """(column of the rows, quantity) of what is looked at."""


@dataclass(frozen=True, slots=True)
class Watched:
    """A run begins."""

    thruster: str
    t0_ns: int
    """`time.monotonic_ns()` of t = 0."""
    streams: tuple[WatchedStream, ...]
    highest: float
    """V, the largest |command| of the plan."""
    false_alarms_per_hour: float
    twin: str = ""
    """Path; empty: the static curve is learnt from the run itself."""


@dataclass(frozen=True, slots=True)
class Mismatch:
    """The run no longer fits what it was, or the twin. Times in s of the recording."""

    t0_ns: int
    """Of the run: it may be over when this comes."""
    thruster: str
    time: float
    began: float
    place: str
    headline: str
    """For one line of a screen."""
    statement: str
    """A sentence a person can act on."""
    size: float
    """N."""
    e_value: float


@dataclass(frozen=True, slots=True)
class Standing:
    """A mismatch as it is known by now. Times in s of the recording."""

    place: str
    what: str
    """What is off and by how much: `thrust -3.1 % (-2.4 N)`."""
    headline: str
    began: float
    from_start: bool
    """It was there from the first stretch on."""
    sigma: float
    """|size| in its standard deviations."""
    brief: str
    """What to do first, in a few words."""
    advice: str


@dataclass(frozen=True, slots=True)
class Judged:
    """How a run stands after one more stretch of it."""

    t0_ns: int
    """Of the run: it may be over when this comes."""
    stretches: int
    """Looked at so far."""
    enough: bool
    """To say whether it fits."""
    mismatch: Standing | None
