"""Faults that the samples of one channel show: no number, or the same number although all else moves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.faults.cells import Cells, explained, fitted, own, shapes
from identification.mismatch.value import Value
from identification.recording import Channel, Floats, Recording

FOLLOWERS = ("thrust", "rotation_rate", "current", "torque", "motor_voltage")
"""What must move when the command does."""


def missing(recording: Recording) -> Iterator[tuple[str, str, dict[str, Value]]]:
    """(quantity, statement, parameters) of channels that lack numbers."""
    for quantity in dict.fromkeys(c.quantity for c in recording.channels if c.quantity):
        channel = own(recording, quantity)
        if channel is None or not channel.time.size:
            continue
        bad = np.isnan(channel.value)
        good = np.flatnonzero(~bad)
        if not good.size:
            yield quantity, f"{quantity} holds no number at all.", {"share": Value(1.0, 0.0, "1")}
            continue
        late = bad[good[0] :] if good[0] <= policy.faults.LEADING_GAP * bad.size else bad
        share = float(np.mean(late))
        if share <= policy.faults.MISSING_SHARE or np.count_nonzero(late) < 3:
            continue
        values = {"share": Value(share, 0.0, "1")}
        ends = np.flatnonzero(np.diff(np.concatenate([[0], bad.astype(int), [0]])))
        longest = max(zip(ends[::2].tolist(), ends[1::2].tolist(), strict=True), key=lambda e: e[1] - e[0])
        start = float(channel.time[longest[0]])
        end = float(channel.time[min(longest[1], bad.size - 1)])
        values |= {"start": Value(start, 0.0, "s"), "end": Value(end, 0.0, "s")}
        says = (
            f"{quantity} gives no number in {100 * share:.3g} % of its rows, longest from {start:.4g} s to {end:.4g} s."
        )
        yield quantity, says, values


@dataclass(frozen=True, slots=True)
class Stuck:
    """A channel that stands at one value from `start` to `end` s while what it follows does not."""

    start: float
    end: float
    at: Value
    p_value: float
    statement: str

    @property
    def start_value(self) -> Value:
        return Value(self.start, 0.0, "s")

    @property
    def end_value(self) -> Value:
        return Value(self.end, 0.0, "s")


def stuck(recording: Recording, cells: Cells) -> Iterator[tuple[str, Stuck]]:
    """Channels that repeat one value while what drives them moves."""
    for quantity in FOLLOWERS:
        channel = own(recording, quantity)
        if channel is None or quantity == cells.driver_quantity or channel.time.size < policy.faults.STUCK_ROWS:
            continue
        found = _stuck(channel, cells)
        if found is not None:
            yield quantity, found


def _stuck(channel: Channel, cells: Cells) -> Stuck | None:
    good = np.isfinite(channel.value)
    time, value = channel.time[good], channel.value[good]
    if value.size < policy.faults.STUCK_ROWS:
        return None
    low, high = _longest(value)
    rows = high - low
    share = (time[high - 1] - time[low]) / max(time[-1] - time[0], 1e-9)
    if rows < policy.faults.STUCK_ROWS or share < policy.faults.STUCK_SHARE:
        return None
    start, end, at = float(time[low]), float(time[high - 1]), float(value[low])
    inside = (cells.time >= start) & (cells.time <= end)
    if not _should_move(channel, cells, inside, at, value, whole=rows == value.size):
        return None
    repeats = np.count_nonzero(np.diff(value) == 0) - (rows - 1)
    again = (repeats + 1) / (value.size - rows + 2)
    p = float(min(1.0, value.size * again ** (rows - 1))) if rows < value.size else 0.0
    says = (
        f"{channel.quantity} stands at {at:.4g} {channel.unit} from {start:.4g} s to {end:.4g} s, {rows} equal rows, "
        f"while the {cells.driver_quantity} moves: it is frozen."
    )
    return Stuck(start, end, Value(at, 0.0, channel.unit), p, says)


def _longest(value: Floats) -> tuple[int, int]:
    """First and one past the last row of the longest run of equal values."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(value) != 0) + 1, [value.size]])
    i = int(np.argmax(np.diff(edges)))
    return int(edges[i]), int(edges[i + 1])


def _should_move(
    channel: Channel, cells: Cells, inside: NDArray[np.bool_], at: float, value: Floats, *, whole: bool
) -> bool:
    """Whether the driver tells it to be elsewhere for a good part of the stretch.

    At an end of its range only values on the inner side count: a clipped channel stands still there, and is right.
    """
    x = cells.driver[inside]
    if x.size < 4 or np.ptp(x) < policy.faults.STUCK_MOVEMENT:
        return False
    if whole:
        return True
    y = np.where(inside, np.nan, cells.values.get(str(channel.quantity), np.nan))
    if np.count_nonzero(np.isfinite(y)) < policy.faults.STUCK_ROWS:
        return False
    law, free = _law(cells, y)
    if law is None:
        return False
    x_outside = cells.driver[~inside]
    reached = free | ((x >= x_outside.min() - 0.05) & (x <= x_outside.max() + 0.05))
    beta, _ = fitted(law, y)
    off = (law[inside] @ beta - at) / max(float(np.ptp(value)), 1e-300)
    edge = 1e-6 * float(np.ptp(value))
    above = at < float(value.max()) - edge  # it could have been higher
    below = at > float(value.min()) + edge
    wrong = ((off > policy.faults.STUCK_MOVEMENT) & above) | ((off < -policy.faults.STUCK_MOVEMENT) & below)
    return bool(np.mean(wrong & reached) > policy.faults.STUCK_ELSEWHERE)


def _law(cells: Cells, y: Floats) -> tuple[Floats | None, bool]:
    """Columns of what the channel follows, and whether it holds beyond the levels seen (a law of one shape does)."""
    known = shapes(cells.driver)
    for name in ("linear", "quadratic"):
        if explained(known[name], y) > policy.faults.STUCK_LAW:
            return known[name], True
    for name in ("odd", "even"):
        if explained(known[name], y) > policy.faults.ODD_LAW:
            return known[name], False
    return None, False
