"""What a device makes of a quantity before it says a number: a first-order low pass, then the mean over a window.

Exact for a quantity that stands still between times at which it jumps, as a command does and a model on intervals, or
that decays there by exponentials, as what follows a command does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats
from identification.run_history.filters import integral_at, places_of, recursion

Places = tuple[NDArray[np.intp], Floats]
"""(k,) interval of each time, and s since it began."""
ALL = slice(None)
ALIKE = 1e-4
"""Relative: rates that are no farther apart are one."""


@dataclass(frozen=True, eq=False, slots=True)
class Mode:
    """What is `size` e^(-rate s) beside a value, s after each interval began; the real part counts."""

    size: Floats | NDArray[np.complex128]
    """(K,)"""
    rate: Floats | NDArray[np.complex128]
    """(K,) 1/s, not 0."""

    def at(self, since: Floats, index: NDArray[np.intp] | slice = ALL) -> Floats:
        """`since` s after the intervals `index` began, as all that follows."""
        since = np.maximum(since, 0.0)
        left: Floats = np.exp(-np.real(self.rate)[index] * since)
        if np.iscomplexobj(self.size) or np.iscomplexobj(self.rate):
            left *= np.abs(self.size)[index]
            left *= np.cos(np.angle(self.size)[index] - np.imag(self.rate)[index] * since)
        else:
            left *= np.real(self.size)[index]
        return left

    def integral(self, since: Floats, index: NDArray[np.intp] | slice = ALL) -> Floats:
        """Since then."""
        rate = self.rate[index]
        out: Floats = np.real(self.size[index] * -np.expm1(-rate * np.maximum(since, 0.0)) / rate)
        return out

    def behind(self, tau: float, since: Floats, index: NDArray[np.intp] | slice = ALL) -> Floats:
        """What a low pass of `tau` s that held nothing then has taken up of it."""
        rate, since = self.rate[index], np.maximum(since, 0.0)
        apart = 1 - rate * tau
        alike = np.abs(apart) < ALIKE
        slow = np.exp(-since / tau)
        taken = np.where(alike, since / tau * slow, (np.exp(-rate * since) - slow) / np.where(alike, 1.0, apart))
        out: Floats = np.real(self.size[index] * taken)
        return out


@dataclass(frozen=True, slots=True)
class Converter:
    """How samples come to be that are no instants."""

    window: float = 0.0
    """s that a sample is the mean over, around its time; 0: of an instant."""
    low_pass: float = 0.0
    """s, time constant of what the quantity passes before; 0: none."""

    @property
    def instant(self) -> bool:
        return self.window <= 0 and self.low_pass <= 0

    def response(self, frequency: Floats) -> NDArray[np.complex128]:
        """(n,) what a sample holds of waves of these frequencies in Hz.

        >>> at = np.array([10.0])
        >>> [abs(Converter(0.05).response(at)).round(3), abs(Converter(low_pass=0.01).response(at)).round(3)]
        [array([0.637]), array([0.847])]
        """
        meaned = np.sinc(frequency * max(self.window, 0.0))
        out: NDArray[np.complex128] = meaned / (1.0 + 2j * np.pi * frequency * max(self.low_pass, 0.0))
        return out

    def places(self, edges: Floats, at: Floats) -> tuple[Places, ...]:
        """Where the samples at `at` (k,) look at a course on intervals between `edges`."""
        if self.window <= 0:
            return (places_of(edges, at),)
        return places_of(edges, at - 0.5 * self.window), places_of(edges, at + 0.5 * self.window)

    def shown(self, value: Floats, dt: Floats, places: tuple[Places, ...], modes: Sequence[Mode] = ()) -> Floats:
        """(k,) samples at `places` of what is `value` (K,) in intervals of `dt` (K,) s, and `modes` beside it; it had
        settled at the first value before."""
        passed = self._passed(value, dt, places, modes)
        if self.window <= 0:
            return passed[0]
        within = [mode.integral(dt) for mode in modes]
        before = np.concatenate([[0.0], np.cumsum(np.sum(within, axis=0))])[:-1] if modes else np.zeros(dt.size)

        def until(at: Places, y: Floats) -> Floats:
            index, since = at
            more = sum((mode.integral(since, index) for mode in modes), before[index])
            return integral_at(value, dt, at) + more - self.low_pass * y  # of y' = (u - y) / tau

        begin, end = (until(at, y) for at, y in zip(places, passed, strict=True))
        out: Floats = (end - begin) / self.window
        return out

    def _passed(
        self, value: Floats, dt: Floats, places: tuple[Places, ...], modes: Sequence[Mode]
    ) -> tuple[Floats, ...]:
        """Behind the low pass, at the very instants."""
        tau = self.low_pass
        if tau <= 0:
            return tuple(sum((mode.at(since, index) for mode in modes), value[index]) for index, since in places)
        keep = np.exp(-dt / tau)
        push = sum((mode.behind(tau, dt) for mode in modes), (1 - keep) * value)
        left = np.concatenate([value[:1], recursion(keep, push, float(value[0]))[:-1]]) - value
        return tuple(
            sum(
                (mode.behind(tau, since, index) for mode in modes),
                value[index] + left[index] * np.exp(-np.maximum(since, 0.0) / tau),
            )
            for index, since in places
        )
