"""Times of a file: numbers in a unit, ISO 8601, a pattern of strptime, a rate, or levels held for a stated time."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime

import numpy as np

from identification.recording import Floats
from rig.importing.mapping import Time
from rig.importing.units import seconds


def reader(clock: Time) -> Callable[[str], float]:
    """A function from a cell to seconds on the file's own clock; raises ValueError for what is no time."""
    if clock.format:
        return lambda cell: _stamp(cell, clock.format).timestamp()
    factor = seconds(clock.unit)
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


def regular(clock: Time, n: int) -> Floats:
    """Times of n rows for a rate, s from the first; for levels of one length, those of their starts."""
    if clock.level_duration is not None:
        return np.arange(n, dtype=np.float64) * clock.level_duration
    if clock.rate is None:
        raise ValueError("a clock without rate and level_duration has a column")
    return np.arange(n, dtype=np.float64) / np.float64(clock.rate)
