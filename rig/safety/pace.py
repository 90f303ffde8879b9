"""Does a stream keep its pace, and is what comes readable? Counted over whole windows. Pure: time is given.

A stream that comes at a tenth of its rate is never old, and one with spoilt lines always has a good one that is young:
both pass every check of a single sample (docs/reliability.md, promise 8).
"""

from __future__ import annotations

from rig.safety.guard import Trip, Vitals

WINDOW = 1.0
"""s, shortest window; a stream slower than ten rows/s gets ten periods. What is wrong is found within two windows."""
WINDOW_ROWS = 10
SLOWEST, FASTEST = 0.5, 3.0
"""Times the nominal rate. Wide: a stalled machine hands over rows late and together, and that is no fault of theirs."""
MOST_BAD = 0.02
"""Share of frames that could not be understood; a sound RS-232 line has none, a wrong baud rate nearly all."""
LEAST_BAD = 3
"""Frames; fewer in a window are chance (a connector touched)."""


class Pace:
    """One stream, from `start` s on."""

    def __init__(self, stream: str, device: str, period_s: float, start: float) -> None:
        self._stream, self._device, self._nominal = stream, device, 1.0 / period_s
        self._window = max(WINDOW, WINDOW_ROWS * period_s)
        self._start, self._rows = start, 0
        self._health: tuple[int, int] | None = None
        self._trip: Trip | None = None

    def advance(self, rows: int, vitals: Vitals) -> Trip | None:
        """What the last whole window had wrong. `rows`: of this stream, new since the last call."""
        self._rows += rows
        link = (vitals.links or {}).get(self._device)
        health = (link.received, link.bad) if link else (0, 0)
        self._health = health if self._health is None else self._health
        elapsed = vitals.now - self._start
        if elapsed >= self._window:
            received, bad = health[0] - self._health[0], health[1] - self._health[1]
            self._trip = self._paced(self._rows / elapsed, vitals.now) or self._readable(received, bad, vitals.now)
            self._start, self._rows, self._health = vitals.now, 0, health
        return self._trip

    def _paced(self, rate: float, now: float) -> Trip | None:
        if SLOWEST <= rate / self._nominal <= FASTEST:
            return None
        cause = (
            f"{self._stream} came at {rate:.3g} rows/s in the last {self._window:g} s, "
            f"{self._nominal:.3g} are expected ({SLOWEST:g} to {FASTEST:g} times that are allowed)"
        )
        return Trip(cause, "rate", now, self._stream, rate, self._nominal)

    def _readable(self, received: int, bad: int, now: float) -> Trip | None:
        if bad < LEAST_BAD or bad <= MOST_BAD * max(received, bad):
            return None
        cause = (
            f"{self._device}: {bad} of {max(received, bad)} frames in the last {self._window:g} s could not be "
            f"understood, {MOST_BAD:.0%} are allowed: those that could be are not to be trusted either; "
            "check cable and baud rate"
        )
        return Trip(cause, "corrupt", now, self._device, bad, MOST_BAD * received)
