"""How late the thrust follows the rotation from one settled command to the next: half of the way is compared.

A lag of 0.3 s is half-way after 0.2 s; rows that come late are late with all of it. Rotation after command is not
judged: a rotor that gathers speed from rest against water alone may take a second, and that is no fault.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from rig.safety.consistency.look import Look, Means

LATEST, EARLIEST = 0.35, -0.3
"""s that half of the thrust may come after half of n|n|: water, amplifier and stand take up to 0.2 s, telemetry of 20
rows/s comes late itself. Thrust that comes before the rotation: then the rows of the motor are the late ones."""
PER_TRAVEL = 0.05
"""More of it per s that the command travels, for a curve that bends."""
LONGEST_TRAVEL = 2.0
"""s: a slower ramp is not judged."""
LONGEST_WAY = 5.0
"""s from one settled command to the next that are kept."""
SIGMAS = 15.0
SMALL = 0.1
"""Of the largest thrust so far: a step that is smaller is not judged."""
SPACING = 0.009
"""s between two points that are kept."""


class Late(NamedTuple):
    """What was found on one way."""

    seconds: float
    slack: float
    """s, for the time that the command travelled."""

    @property
    def wrong(self) -> bool:
        return not EARLIEST - self.slack <= self.seconds <= LATEST + self.slack

    def __str__(self) -> str:
        if self.seconds > 0:
            allowed = LATEST + self.slack
            late = f"the thrust comes {self.seconds:.2f} s after the rotation, {allowed:.2f} s are allowed"
            return f"{late}: its rows are late"
        allowed = self.slack - EARLIEST
        return (
            f"the rotation comes {-self.seconds:.2f} s after the thrust, {allowed:.2f} s are allowed: the rows of the "
            "motor are late"
        )


class Way:
    """Points from the end of one settled hold to the next."""

    def __init__(self) -> None:
        self._points: list[Look] = []
        self._moved: tuple[float, float] | None = None
        """s, first and last change of the command."""
        self._command: float | None = None

    def clear(self) -> None:
        self._points.clear()
        self._moved = None

    def add(self, look: Look) -> None:
        """One tick, settled or not: of a hold the newest point alone is kept, see `clear`."""
        if look.command != self._command:
            self._command = look.command
            self._moved = (self._moved[0] if self._moved else look.time, look.time)
        new = not self._points or look.time - self._points[-1].time >= SPACING
        if new and look.time - (self._points[0].time if self._points else look.time) <= LONGEST_WAY:
            self._points.append(look)

    @property
    def travel(self) -> float | None:
        """For how many s the command moved; None where it did not, or too slowly to be judged."""
        if self._moved is None or self._moved[1] - self._moved[0] > LONGEST_TRAVEL:
            return None
        return self._moved[1] - self._moved[0]

    def late(self, before: Means, after: Means, zero: float, least: float) -> Late | None:
        """After the rotation. `least` N of step; None: cannot be judged."""
        if before.thrust is None or after.thrust is None or before.rate is None or after.rate is None:
            return None
        ys = [(p.time, p.thrust - zero) for p in self._points if p.thrust is not None]
        xs = [(p.time, p.rate * abs(p.rate)) for p in self._points if p.rate is not None]
        turns = before.rate * abs(before.rate), after.rate * abs(after.rate)
        return self._late(ys, (before.thrust - zero, after.thrust - zero), xs, turns, least)

    def _late(
        self,
        ys: Sequence[tuple[float, float]],
        y_ends: tuple[float, float],
        xs: Sequence[tuple[float, float]],
        x_ends: tuple[float, float],
        least: float,
    ) -> Late | None:
        travel = self.travel
        y_half, x_half = _half(*y_ends), _half(*x_ends)
        if (
            travel is None
            or abs(y_ends[1] - y_ends[0]) < least
            or (abs(y_ends[1]) > abs(y_ends[0])) != (abs(x_ends[1]) > abs(x_ends[0]))
        ):
            return None
        y_time, x_time = _crossing(ys, y_half, y_ends), _crossing(xs, x_half, x_ends)
        if y_time is None or x_time is None:
            return None
        return Late(y_time - x_time, PER_TRAVEL * travel)


def _half(before: float, after: float) -> float:
    """Half-way; of a reversal half of the larger end, for the two directions need not be alike."""
    if before * after >= 0.0:
        return 0.5 * (before + after)
    return 0.5 * max(before, after, key=abs)


def _crossing(points: Sequence[tuple[float, float]], half: float, ends: tuple[float, float]) -> float | None:
    """When (s) the first point is at or beyond it."""
    up = 1.0 if ends[1] > ends[0] else -1.0
    return next((t for t, value in points if up * (value - half) >= 0.0), None)
