"""Axes with round numbers, and series made short enough to draw. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence


def step_of(span: float, most: int) -> float:
    """The smallest of 1, 2, 5 times a power of ten that cuts `span` into at most `most` parts."""
    if span <= 0.0:
        return 1.0
    rough = span / most
    decade = 10.0 ** math.floor(math.log10(rough))
    return next(factor * decade for factor in (1.0, 2.0, 5.0, 10.0) if factor * decade >= rough * (1.0 - 1e-9))


def ticks(low: float, high: float, most: int) -> tuple[list[float], list[str]]:
    """Round positions within `low` .. `high`, and their labels.

    >>> ticks(-161.3, 161.3, 5)
    ([-100.0, 0.0, 100.0], ['-100', '0', '100'])
    """
    step = step_of(high - low, most)
    digits = max(0, -math.floor(math.log10(step) + 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    places = [step * k for k in range(first, last + 1)]
    return places, [f"{place:.{digits}f}" for place in places]


def reach(values: Sequence[float], margin: float = 0.05, least: float = 1e-6) -> tuple[float, float]:
    """Least and greatest of `values`, widened by `margin` of their span and to at least `least` in all."""
    low, high = min(values), max(values)
    room = max(margin * (high - low), (least - (high - low)) / 2.0)
    return low - room, high + room


def to_row(value: float, low: float, high: float, rows: int) -> float:
    """Where on an axis `low` .. `high` of `rows` cells a full-cell mark must be put to fall into the cell with the
    braille dot of `value`: plotext rounds the two on different grids, up to a cell apart.

    >>> round(to_row(0.6, 0.0, 1.0, 3), 3)
    0.5
    """
    if rows < 2:
        return value
    dot = math.floor(0.5 + (4 * rows - 1) * (value - low) / (high - low))
    return low + (high - low) * (dot // 4) / (rows - 1)


def thin(rows: Sequence[tuple[float, float]], buckets: int) -> tuple[list[float], list[float]]:
    """At most two rows, the least and the greatest, in each of `buckets` equal spans of time: no peak is lost.
    NaN rows go."""
    finite = [row for row in rows if math.isfinite(row[1])]
    span = finite[-1][0] - finite[0][0] if finite else 0.0
    if len(finite) <= 2 * buckets or span <= 0.0:
        return [t for t, _ in finite], [value for _, value in finite]
    groups: dict[int, list[tuple[float, float]]] = {}
    for row in finite:
        groups.setdefault(int((row[0] - finite[0][0]) / span * buckets), []).append(row)
    kept = [extreme(group, key=_value) for group in groups.values() for extreme in (min, max)]
    return [t for t, _ in kept], [value for _, value in kept]


def _value(row: tuple[float, float]) -> float:
    return row[1]
