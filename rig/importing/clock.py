"""Times of a file: numbers in a unit, ISO 8601, a pattern of strptime, a rate, or levels held for a stated time."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from typing import Final

import numpy as np

from identification.recording import Floats
from rig.importing.mapping import Time

SECONDS: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}


def reader(clock: Time) -> Callable[[str], float]:
    """A function from a cell to seconds on the file's own clock; raises ValueError for what is no time."""
    if clock.format:
        return lambda cell: _stamp(cell, clock.format).timestamp()
    factor = SECONDS[clock.unit]
    return lambda cell: float(cell) * factor


def _stamp(cell: str, pattern: str) -> datetime:
    """A time without a zone counts as UTC, which is right for differences."""
    cell = cell.strip()
    if pattern == "iso":
        when = datetime.fromisoformat(cell)
        return when if when.tzinfo else when.replace(tzinfo=UTC)
    if "%z" in pattern:
        return datetime.strptime(cell, pattern).astimezone(UTC)
    return datetime.strptime(cell, pattern).replace(tzinfo=UTC)


def wall_clock(clock: Time, cell: str) -> tuple[str, bool]:
    """ISO text of a time stamp and whether its zone is known; ("", False) when times are plain numbers."""
    if not clock.format:
        return "", False
    when = _stamp(cell, clock.format)
    known = "%z" in clock.format or (clock.format == "iso" and datetime.fromisoformat(cell.strip()).tzinfo is not None)
    return (when.astimezone(UTC) if known else when.replace(tzinfo=None)).isoformat(), known


def regular(clock: Time, n: int, *, command: bool) -> Floats:
    """Times of n rows for a rate or for levels; a level's command stands at its start, its values in its middle."""
    if clock.level_duration is not None:
        return (np.arange(n, dtype=np.float64) + (0.0 if command else 0.5)) * clock.level_duration
    if clock.rate is None:
        raise ValueError("a clock without rate and level_duration has a column")
    return np.arange(n, dtype=np.float64) / np.float64(clock.rate)
