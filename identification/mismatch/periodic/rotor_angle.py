"""The angle that the rotor has turned at any time, and a wave over it, or over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats
from identification.run_history.filters import integral


def turned(edges: Floats, speed: Floats, at: Floats) -> Floats:
    """Angle turned at each time, from the mean speed (M,) in the intervals between `edges` (M+1,): integral of |n|."""
    return integral(np.abs(speed), edges, at)


def turned_by_rate(time: Floats, rate: Floats, at: Floats) -> Floats:
    """Angle turned (rev) at each time, from samples of the rotation rate (rev/s), straight lines between them."""
    good = np.isfinite(rate)
    t, n = time[good], np.abs(rate[good])
    total = np.concatenate([[0.0], np.cumsum(0.5 * (n[1:] + n[:-1]) * np.diff(t))])
    index = np.clip(np.searchsorted(t, at, side="right") - 1, 0, t.size - 1)
    since = at - t[index]
    slope = np.append(np.diff(n) / np.maximum(np.diff(t), 1e-12), 0.0)[index]
    inside = np.clip(since, 0.0, np.append(np.diff(t), 0.0)[index])
    out: Floats = total[index] + n[index] * since + 0.5 * slope * inside**2
    return out


@dataclass(frozen=True, eq=False, slots=True)
class Part:
    """a cos(phi) + b sin(phi), as far as it is shown, from `start` to `end` (s) of one run."""

    run: int
    start: float
    end: float
    a: float
    b: float
    weight: tuple[Floats, NDArray[np.complex128]] | None = None
    """Times in s, and what is shown then of its size and phase; None: all."""

    def at(self, time: Floats, angle: Floats) -> Floats:
        """(n,) N."""
        wave = complex(self.a, -self.b) * np.exp(1j * angle)
        if self.weight is not None:
            wave *= np.interp(time, *self.weight)
        return np.asarray(wave.real, dtype=np.float64)


def wave_of(parts: Sequence[Part], run: int, time: Floats, angle: Floats) -> Floats:
    """(n,) N at these times of a run, from phi = angle (n,) rad; 0 where no part is."""
    out = np.zeros_like(time)
    for part in parts:
        if part.run == run:
            inside = (time >= part.start) & (time < part.end)
            out[inside] += part.at(time[inside], angle[inside])
    return out
