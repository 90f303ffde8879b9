"""What ticks of a command do at the samples beside the line through means, as a lag, ringing and a delay pass them on.

Between two ticks the driver stands still: the rotor follows it by its own equation, and ringing is a decaying
exponential that each tick adds to. So the response is known at any time, not only at the ends of intervals. The force
rings, not the driver: a tick that rings on adds to it by what the force changed then, however slow the rotor is now.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats
from identification.run_history.converter import Mode
from identification.run_history.filters import complex_recursion, resonant
from identification.run_history.remembered import RememberedRun
from identification.run_history.rotor_lag import AT_REST, Rotor, follow_rate, lag_ends, lagged, to_rest

SETTLED = 25.0
"""Time constants after which a rotor has followed and ringing has died away."""
BENT, MOST_BENDS = 0.005, 16
"""Change of a rate of following times the gap between two knots, above which there are some between; how many."""
FOREVER = 1e9
"""s: a rotor that nothing brakes has not followed by then."""
SLOWEST = 1e-3
"""Rate of following, beside that at the largest driver, of a rotor that hardly turns."""


@dataclass(frozen=True, slots=True)
class Passed:
    """Dynamics between the driver and a channel: first a rotor that follows, then a stand that rings, then a delay."""

    rotor: Rotor | None = None
    """None: at once."""
    ring: tuple[float, float, float] | None = None
    """Compliance c, frequency w / 2 pi in Hz, damping z: transfer function 1 - c + c w^2/(p^2 + 2 z w p + w^2)."""
    delay: float = 0.0
    """s."""

    def means(self, run: RememberedRun) -> Floats:
        """(M,) of the rotor's rate, means over intervals, of a driver that stands still in each."""
        out = run.driven(self.rotor)
        return run.delayed(out, self.delay) if self.delay else out

    def force_means(self, run: RememberedRun) -> Floats:
        """(M,) of rate |rate|, means over intervals, of a driver that stands still in each: what comes late is the
        force, as in the model, and no mean of it is the square of a mean."""
        if self.ring is not None:
            return self.rung_means(run)
        rate = run.driven(self.rotor)
        force = rate * np.abs(rate)
        return run.delayed(force, self.delay) if self.delay else force

    def rung_means(self, run: RememberedRun) -> Floats:
        """(M,) of rate |rate| as the stand shows it, means over intervals, of a driver that stands still in each."""
        assert self.ring is not None
        history = run.history
        x = run.driven(self.rotor)
        force = x * np.abs(x)
        moved = force - history.driver[0] * np.abs(history.driver[0])
        out = force + self.ring[0] * (resonant(moved, history.dt, *self.ring[1:]) - moved)
        return run.delayed(out, self.delay) if self.delay else out

    def unsettled(self, value: Floats) -> Floats:
        """(T,) s after each tick from which on `value` (T,) is held, until the rotor has followed."""
        if self.rotor is None:
            return np.zeros(value.size)
        rate = self.rotor.quadratic * np.abs(value) + self.rotor.linear_at(value)
        return SETTLED / np.maximum(rate, SETTLED / FOREVER)

    def followed(self, last: NDArray[np.intp], since: Floats, value: Floats, rates: Floats) -> Floats:
        """(N,) the rate `since` s + delay after the tick `last`, of a driver that takes `value` (T,) at the ticks;
        `rates` (T,) of the rotor there."""
        held: Floats = value[last]
        return held if self.rotor is None else lagged(held, rates[last], since, self.rotor)

    def ring_modes(self, when: Floats, value: Floats) -> tuple[Mode, ...]:
        """What the stand adds to rate |rate| after each of the knots `when` (T,); what rings is the last of them.

        Between two knots the force is steady but for the modes of the rotor, e^(-r s) each, and so is what a stand
        shows of them: times w^2/(r^2 - 2 z w r + w^2). It rings by what its place and its speed lack of that then.
        """
        assert self.ring is not None
        c, f, z = self.ring
        w = 2 * np.pi * f
        pole = complex(-z * w, w * np.sqrt(max(1 - z**2, 1e-9)))
        steady, modes = self.rotor_modes(when, value)
        shown = [Mode(m.size * w**2 / (m.rate**2 - 2 * z * w * m.rate + w**2), m.rate) for m in modes]
        gap = np.diff(when, prepend=when[0])
        before = slice(0, -1)
        place, speed = np.zeros(when.size), np.zeros(when.size)
        place[1:] = -np.diff(steady)
        for each in shown:
            ended = each.at(gap[1:], before)
            place[1:] += ended - np.real(each.size[1:])
            speed[1:] -= np.real(each.rate[before] * ended - (each.rate * each.size)[1:])
        lacking = place + 1j * (pole.real * place - speed) / pole.imag
        rings = c * complex_recursion(np.exp(pole * gap), lacking)
        follow = (Mode(c * (s.size - m.size), m.rate) for s, m in zip(shown, modes, strict=True))
        return (*follow, Mode(rings, np.full(rings.size, -pole)))

    def rotor_modes(self, when: Floats, value: Floats) -> tuple[Floats, tuple[Mode, ...]]:
        """Rate |rate| after the ticks `when` (T,), from which on `value` (T,) is held: where it goes, and two modes,
        none of a rotor that follows at once.

        n = w + (n0 - w) e^(-l s) has the square w^2 + 2 w (n0 - w) e^(-l s) + (n0 - w)^2 e^(-2 l s). Where it turns
        round between two ticks (`knots` has none such) its sign is that of its beginning.
        """
        if self.rotor is None:
            return value * np.abs(value), ()
        ends = lag_ends(value[:-1], np.diff(when), self.rotor, float(value[0]))
        begin = np.concatenate([value[:1], ends])
        rate = follow_rate(value, 0.5 * (begin + np.append(ends, value[-1])), self.rotor)
        rate = np.maximum(rate, SLOWEST * float(np.max(rate)))
        sign = np.sign(np.where(np.abs(begin) > AT_REST, begin, value))
        gap = begin - value
        return sign * value**2, (Mode(sign * 2 * value * gap, rate), Mode(sign * gap**2, 2 * rate))

    def knots(self, when: Floats, value: Floats) -> tuple[Floats, Floats]:
        """The ticks, where the rotor passes through rest between two, and more where its rate of following changes."""
        if self.rotor is None:
            return when, value
        turning = with_knots((when, value), self._turning_points(when, value))
        return turning if self.rotor.quadratic == 0 else with_knots(turning, self._bends(*turning))

    def _bends(self, when: Floats, value: Floats) -> Floats:
        """s: places between knots, as many in each gap as its rate of following changes there."""
        assert self.rotor is not None
        held, gap = value[:-1], np.diff(when)
        end = lag_ends(held, gap, self.rotor, float(value[0]))
        begin = np.concatenate([value[:1], end[:-1]])
        change = gap * np.abs(follow_rate(held, end, self.rotor) - follow_rate(held, begin, self.rotor))
        many = np.minimum(np.ceil(np.sqrt(change / BENT)), MOST_BENDS).astype(int)
        gaps = np.repeat(np.arange(gap.size), many)
        first = np.repeat(np.cumsum(many) - many, many)
        out: Floats = when[gaps] + gap[gaps] * (np.arange(gaps.size) - first) / many[gaps]
        return out

    def _turning_points(self, when: Floats, value: Floats) -> Floats:
        """Times in s."""
        assert self.rotor is not None
        ends = lag_ends(value[:-1], np.diff(when), self.rotor, float(value[0]))
        begin = np.concatenate([value[:1], ends[:-1]])
        at = np.flatnonzero(begin * value[:-1] < 0)
        w, n = value[at], begin[at]
        found = when[at] + to_rest(w, n, self.rotor)
        out: Floats = found[found < when[at + 1]]
        return out


def lasts(mode: Mode) -> Floats:
    """(T,) s after each knot until it has died away."""
    return np.asarray(SETTLED / np.real(mode.rate), dtype=np.float64)


def with_knots(held: tuple[Floats, Floats], at: Floats) -> tuple[Floats, Floats]:
    """The same staircase with knots `at` beside its own: rates of following change between two that are far apart."""
    when, value = held
    knots = np.union1d(when, at[(at > when[0]) & (at < when[-1])])
    return knots, value[np.searchsorted(when, knots, side="right") - 1]
