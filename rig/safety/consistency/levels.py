"""What a settled command gave, beside what the levels before it gave: the same again, and what lies near it.

A static curve may bend (dead band, winding loss, two unlike directions), but it is one: each level bounds the others.
"""

from __future__ import annotations

from collections.abc import Callable
from math import copysign, inf, log
from typing import NamedTuple

from rig.safety.consistency.look import CURRENT, DIGITS, NAMES, RATE, THRUST, UNITS, Means

AGAIN = (1.4, 2.0, 1.6)
"""Most that rotation, current and thrust may differ, as a factor: overshoots after a reversal (a third of the thrust
after a second), warmth, water that goes round. Thrust and current are per n|n| where the rotation is known."""
ACROSS = 2.4
"""The same for the thrust of the other direction: a propeller may push 0.6 times as much astern, and reversed."""
FLATTEST = 0.4
"""Least exponent of rotation over voltage: a winding that takes a third of the voltage at the top has 0.46 there."""
DEAD = 0.12
"""Of the bench's largest voltage: widest dead band; a curve through it is the steepest that is believed."""
FAR = 2.5
"""Ratio of two voltages beyond which one says nothing of the other."""
SIGMAS = 10.0
"""Times the mean step from one block to the next: what is smaller is no evidence."""
SMALL = 0.08
"""Of the largest thrust so far: nor this."""
REST = 0.3
"""Of the largest thrust so far: what may be left of it at rest."""
TOP = 0.4
"""Of the bench's largest voltage: from here on a propeller that turns must push."""
NO_PUSH = 3.0
"""Times the mean step from one block to the next: thrust that cannot be told from none."""


class Level(NamedTuple):
    """One settled command of a run."""

    volts: float
    means: Means
    zero: float | None
    """N, what the force sensor said at the rest before; None: there was none yet."""
    noise: Means = Means(None, None, None)
    """Mean step from one block to the next, so far."""

    @property
    def push(self) -> float | None:
        """N, of the propeller."""
        return None if self.means.thrust is None or self.zero is None else self.means.thrust - self.zero

    @property
    def turn(self) -> float:
        """n|n| where the rotation is known, else V|V|."""
        x = self.volts if self.means.rate is None else self.means.rate
        return x * abs(x)


class Bounds(NamedTuple):
    """Of a factor."""

    low: float
    high: float


class Levels:
    """Of one run of one thruster, by their voltage."""

    def __init__(self, max_voltage: float) -> None:
        self._max_voltage = max_voltage
        self.known: dict[float, Level] = {}
        self.largest = 0.0
        """N, largest thrust so far."""

    def judge(self, new: Level, *, flowing: bool) -> str:
        """A level that has just settled. Empty, or what does not fit. In flowing water thrust goes with the speed of
        advance: rotation and current alone are judged then."""
        if new.volts == 0.0:
            return self._rest(new)
        cause = self._factor(RATE, new, self._rate)
        if not cause and not flowing:
            cause = self._no_push(new) or self._factor(THRUST, new, self._push)
        return cause or self._factor(CURRENT, new, self._current)

    def keep(self, new: Level) -> None:
        """It was believed to the end of its hold."""
        if new.volts == 0.0:
            known = self.known.values()
            self.known = {e.volts: e._replace(zero=new.means.thrust) if e.zero is None else e for e in known}
        self.known[round(new.volts, 6)] = new
        self.largest = max(self.largest, *(abs(each.push or 0.0) for each in self.known.values()))

    def _rest(self, new: Level) -> str:
        before, push = self.known.get(0.0), new.push
        least = max(REST * self.largest, SIGMAS * (new.noise.thrust or 0.0))
        if before is None or push is None or not self.largest or abs(push) <= least:
            return ""
        return (
            f"the thrust is {push:.4g} N at rest, where it was 0 N before: it does not follow the motor; {least:.3g} N "
            "are allowed"
        )

    def _no_push(self, new: Level) -> str:
        push, noise = new.push, new.noise.thrust
        enough = abs(new.volts) >= TOP * self._max_voltage
        if not enough or push is None or noise is None or abs(push) > NO_PUSH * noise:
            return ""
        return f"the thrust does not follow: {push:.4g} N at {new.volts:g} V, not more than its noise"

    def _factor(
        self, channel: int, new: Level, judge: Callable[[Level, Level], tuple[float, float, Bounds] | None]
    ) -> str:
        known = self._nearest(new, across=channel == THRUST)
        found = known and judge(new, known)
        if not known or not found:
            return ""
        value, expected, factor = found
        low, high = sorted((factor.low * expected, factor.high * expected))
        if low <= value <= high or not self._evident(channel, new, max(abs(value), abs(expected))):
            return ""
        before = known.push if channel == THRUST else known.means[channel]
        if not self._evident(channel, new, abs(before or 0.0)):
            return ""
        return (
            f"{NAMES[channel]} is {value:.4g} {UNITS[channel]} at {new.volts:g} V, where {low:.4g} to {high:.4g} "
            f"{UNITS[channel]} are expected by what {known.volts:g} V gave before"
        )

    def _evident(self, channel: int, new: Level, size: float) -> bool:
        least = max(SIGMAS * (new.noise[channel] or 0.0), DIGITS[channel])
        return size > max(least, SMALL * self.largest if channel == THRUST else 0.0)

    def _nearest(self, new: Level, *, across: bool) -> Level | None:
        """By the ratio of voltages; of the other direction only where there is none of this one."""
        same = [each for each in self.known.values() if each.volts * new.volts > 0]
        other = [each for each in self.known.values() if each.volts * new.volts < 0 and across]
        near = [each for each in same or other if 1 / FAR <= abs(new.volts / each.volts) <= FAR]
        return min(near, key=lambda each: abs(log(abs(new.volts / each.volts))), default=None)

    def _rate(self, new: Level, known: Level) -> tuple[float, float, Bounds] | None:
        if new.means.rate is None or known.means.rate is None:
            return None
        return new.means.rate, known.means.rate, self._curve(new, known, AGAIN[RATE])

    def _push(self, new: Level, known: Level) -> tuple[float, float, Bounds] | None:
        pushes = new.push, known.push
        if pushes[0] is None or pushes[1] is None or not known.turn:
            return None
        again = AGAIN[THRUST] if new.volts * known.volts > 0 else ACROSS
        if new.means.rate is None or known.means.rate is None:
            bounds = self._curve(new, known, 1.0)
            along = copysign(1.0, new.volts * known.volts)
            return pushes[0], along * pushes[1], Bounds(bounds.low**2 / again, bounds.high**2 * again)
        return pushes[0], pushes[1] * new.turn / known.turn, Bounds(1 / again, again)

    def _current(self, new: Level, known: Level) -> tuple[float, float, Bounds] | None:
        """Of levels near each other alone: how much of it is friction is not known."""
        amps = new.means.current, known.means.current
        if amps[0] is None or amps[1] is None or not known.turn or not 0.7 <= new.volts / known.volts <= 1.4:
            return None
        again = AGAIN[CURRENT]
        return abs(amps[0]), abs(amps[1] * new.turn / known.turn), Bounds(1 / again, again)

    def _curve(self, new: Level, known: Level, again: float) -> Bounds:
        """Of the rotation: between a curve that flattens and one through the widest dead band."""
        ratio, dead = abs(new.volts / known.volts), DEAD * self._max_voltage
        flat, steep = ratio**FLATTEST, inf if ratio > 1 else 0.0
        if min(abs(new.volts), abs(known.volts)) > 1.5 * dead:
            steep = (abs(new.volts) - dead) / (abs(known.volts) - dead)
        elif ratio == 1:
            steep = 1.0
        return Bounds(min(flat, steep) / again, max(flat, steep) * again)
