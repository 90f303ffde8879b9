"""All thresholds by their names, and a run with some of them elsewhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import ModuleType

from identification.mismatch.policy import (
    answer,
    compare,
    estimate,
    faults,
    locate,
    name,
    next_experiment,
    periodic,
    prepare,
    select,
    unnamed,
    validate,
    vehicle,
)
from identification.mismatch.policy.record.threshold import Count, Threshold

ROOMS = (
    prepare,
    faults,
    estimate,
    periodic,
    select,
    locate,
    name,
    validate,
    unnamed,
    answer,
    next_experiment,
    compare,
    vehicle,
)
"""In the order of a diagnosis."""


def thresholds() -> Iterator[tuple[str, Threshold | Count]]:
    """Qualified name (select.SCREENING_FALSE_ALARM) and threshold, room by room."""
    for room in ROOMS:
        for known, value in vars(room).items():
            if isinstance(value, Threshold | Count):
                yield f"{_short(room)}.{known}", value


@contextmanager
def overridden(values: Mapping[str, float]) -> Iterator[None]:
    """Thresholds moved to other `values`, by their qualified names, until the block ends.

    For benchmarks/sensitivity/sensitivity.py alone, for the whole process: another thread's diagnosis sees them too.
    Raises KeyError for what is no threshold.
    """
    known = dict(thresholds())
    moved = {each: known[each].moved(value) for each, value in values.items()}
    try:
        _put(moved)
        yield
    finally:
        _put({each: known[each] for each in moved})


def _put(values: Mapping[str, Threshold | Count]) -> None:
    rooms = {_short(room): room for room in ROOMS}
    for each, value in values.items():
        room, _, known = each.partition(".")
        setattr(rooms[room], known, value)


def _short(room: ModuleType) -> str:
    return room.__name__.rpartition(".")[2]
