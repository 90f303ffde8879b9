"""The supply voltage between its samples: what the load makes of it, and the slow rest."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.prepare.channels import LOADS, REACHES, calmest, driven_at, followed
from identification.mismatch.prepare.grid import Held
from identification.recording import Channel, Floats
from identification.run_history.filters import lowpass

LAGS = (0.0, 0.01, 0.02, 0.04, 0.08, 0.16)
"""s by which a supply may follow its load: an output capacitor of tens of ms, or a rotor."""


def supply(channel: Channel, held: Held, at: Floats, driven: Floats, dt: Floats) -> Floats | None:
    """(M,) V over intervals of `dt` s about `at`, in which the command is `driven`; None without two samples.

    A rest that is no larger than what the steps of the readings make is none of the supply's.
    """
    good = np.isfinite(channel.value)
    if np.count_nonzero(good) < 2 * LOADS:
        return followed(channel, at)
    time, value = channel.time[good], channel.value[good]
    drawing = _Drawing.of(held, time, at, driven, dt)
    load = min((_load(drawing, value, lag) for lag in LAGS), key=lambda each: each.missed)
    apart = np.abs(np.diff(driven_at(held, time))) > policy.prepare.COMMAND_STEP * drawing.size
    step = channel.acquisition.quantum or 0.0
    smooth, missed = calmest(load.rest, REACHES, step, apart)
    if float(np.mean(smooth**2)) <= step**2 / 12:  # a staircase that a meter makes of what the load does
        return load.made
    if missed > (1 - policy.prepare.SUPPLY_REST_TOLD) * float(np.mean(load.rest**2)):
        return load.made
    return load.made + _between(time, smooth, apart, held, at)


@dataclass(frozen=True, eq=False, slots=True)
class _Drawing:
    """What draws on a supply: sizes of the driver as shares of the largest, `size`, and all that was drawn so far."""

    size: float
    now: Floats
    """(M,) over the intervals, and what was drawn at their ends."""
    charge: Floats
    dt: Floats
    """(M,) s."""
    then: Floats
    """(n,) at the samples of the supply, and what was drawn by then."""
    drawn: Floats
    which: NDArray[np.intp]
    """(n,) interval of each sample, and s since that began."""
    since: Floats

    @classmethod
    def of(cls, held: Held, time: Floats, at: Floats, driven: Floats, dt: Floats) -> _Drawing:
        size = float(np.max(np.abs(driven))) or 1.0
        now, begun = np.abs(driven) / size, at - 0.5 * dt
        charge = np.cumsum(now**3 * dt)
        which = np.clip(np.searchsorted(begun, time, side="right") - 1, 0, at.size - 1)
        since = np.clip(time - begun[which], 0.0, None)
        then = np.abs(driven_at(held, time)) / size
        return cls(size, now, charge, dt, then, np.interp(time, at, charge), which, since)

    def power(self, k: int, lag: float) -> tuple[Floats, Floats]:
        """(n,) and (M,) of the driver to the power `k`, followed `lag` s late."""
        then, now = self.then**k, self.now**k
        if not lag:
            return then, now
        end, mean = lowpass(now, self.dt, lag, float(now[0]))
        before = np.concatenate([now[:1], end[:-1]])[self.which]
        return then + (before - then) * np.exp(-self.since / lag), mean


@dataclass(frozen=True, eq=False, slots=True)
class _Load:
    """What the load makes of a supply."""

    made: Floats
    """(M,) V."""
    rest: Floats
    """(n,) V that it leaves of the samples."""
    missed: float
    """The price of that (BIC)."""


def _load(drawing: _Drawing, value: Floats, lag: float) -> _Load:
    """By powers of the driver, followed `lag` s late, and what was drawn so far."""
    powers = [drawing.power(k, lag) for k in range(1, LOADS - 1)]
    most = max(float(drawing.charge[-1]), 1e-12)
    H, G = (
        np.column_stack([np.ones(drawn.size), *(power[i] for power in powers), drawn / most])
        for i, drawn in enumerate((drawing.drawn, drawing.charge))
    )
    kept, missed = _fewest(H, value)
    if lag:
        missed += float(np.log(value.size))
    theta = np.linalg.lstsq(H[:, kept], value, rcond=None)[0]
    return _Load(G[:, kept] @ theta, value - H[:, kept] @ theta, missed)


def _between(time: Floats, value: Floats, apart: NDArray[np.bool_], held: Held, at: Floats) -> Floats:
    """(M,) `value` between its samples, each side of a step of the driver (`apart`, (n-1,)) by its own samples: what
    the load has not yet made of a step is none of what was before it."""
    gap = np.flatnonzero(apart)
    stepped = np.clip(held.time[np.searchsorted(held.time, time[gap + 1], side="right") - 1], time[gap], time[gap + 1])
    before = np.nextafter(stepped, -np.inf)
    knots = np.concatenate([time, before, stepped])
    order = np.argsort(knots, kind="stable")
    out: Floats = np.interp(at, knots[order], np.concatenate([value, value[gap], value[gap + 1]])[order])
    return out


def _fewest(H: Floats, value: Floats) -> tuple[list[int], float]:
    """Columns (the first always) by BIC, and that: every one more brings its share of the channel's noise into the
    voltage."""
    n = value.size
    R: Floats = np.asarray(np.linalg.qr(np.column_stack([H, value]), mode="r"))  # same sums of squares, few rows
    best, least = [0], np.inf
    for many in range(H.shape[1]):
        for others in combinations(range(1, H.shape[1]), many):
            tried = [0, *others]
            left = R[:, -1] - R[:, tried] @ np.linalg.lstsq(R[:, tried], R[:, -1], rcond=None)[0]
            price = n * np.log(max(float(left @ left), 1e-300)) + len(tried) * np.log(n)
            if price < least:
                best, least = tried, price
    return best, least
