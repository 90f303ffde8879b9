"""Samples on the other side of a tick than the clocks say, as the command was quick or slow to the wire then.

A ramp is written in ticks, and each is a jump of thrust and rate. A sample within a millisecond of one is foretold by
what was held before it or after it, and which it was is a matter of what a bus and a drive did that once: of 24 sigma
one such sample was "something left after steps" where nothing was left out. It is no data; nor is one so close to a
tick that the clocks, which are fitted, put it on this side as well as on that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.mismatch.estimate.clock_hollows import FINE, STEP, in_best_hollow
from identification.mismatch.estimate.estimate import unweighted
from identification.mismatch.estimate.fitting import fit, raw
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.select.baseline import start
from identification.mismatch.select.forward_selection import Given
from identification.recording import Floats
from identification.run_history.history import History, Samples

NEAR = 0.0015
"""s from a tick: farther off no bus or drive makes the difference."""
TOO_CLOSE = 0.00015
"""s from a tick: some times the 0.02 ms by which stamps were off where it showed (docs/proof-diary.md, 2026-11-29)."""
FAR_OFF = 4.5
"""Standard deviations, by the median: what is nearer may be noise."""
TOLD = 0.5
"""Of the error, at most, is left where the other side of the tick is what is foretold."""
FEW = 0.01
"""Of the rows: where more are so, the model is wrong and not the side."""
NOT_ALL = 0.03
"""Of the rows, at most, go because they are too close: samples in step with the ticks stay."""


def on_their_side(histories: Sequence[History], given: Given | None = None) -> tuple[History, ...]:
    """The runs without such samples, thrust and rate each by the clock of a first fit of the baseline."""
    if any(h.ticks is None or h.static for h in histories):
        return tuple(histories)
    data, theta = start(histories)
    data, theta, model = given(data, theta) if given is not None else (data, theta, Model())
    even = unweighted(data)
    found = _by_rate(model, in_best_hollow(fit(model, theta, data, even), data, even).theta, data)
    thrust, rate = raw(model, found, data, with_rate=data.with_rate)
    out = []
    for i, h in enumerate(histories):
        error = data.thrust[i] - thrust[i]
        gone = _doubtful(h, h.thrust_samples, h.rows, error, found.shift, lambda v: found.C * v * np.abs(v))
        new = h
        if gone.any():
            new = replace(new, count=np.where(gone, 0, h.count), thrust=np.where(gone, np.nan, h.thrust))
        if data.with_rate and h.rate is not None and h.rate_count is not None:
            error = h.rates - rate[i]
            gone = _doubtful(h, h.rate_samples, h.rate_rows, error, found.rate_shift, lambda v: found.k * v)
            if gone.any():
                counted = np.where(gone, 0, h.rate_count)
                new = replace(new, rate=np.where(gone, np.nan, h.rate), rate_count=counted)
        out.append(new)
    return tuple(out)


def _by_rate(model: Model, found: Theta, data: Data) -> Theta:
    """With the clock of the rate by which it lies nearest: that fit is of the thrust alone."""
    if not data.with_rate or data.most_shift <= 0:
        return found

    def left(moved: Theta) -> float:
        rate = raw(model, moved, data, with_rate=True)[1]
        return sum(float(np.sum(np.abs(h.rates - told))) for h, told in zip(data.histories, rate, strict=True))

    for step in (STEP, STEP / FINE):
        many = math.ceil(data.most_shift / STEP) if step == STEP else FINE
        places = [found.rate_shift + step * i for i in range(-many, many + 1)]
        moved = [replace(found, rate_shift=place) for place in places if abs(place) <= data.most_shift]
        found = min([found, *moved], key=left)
    return found


def _doubtful(
    h: History, samples: Samples, rows: NDArray[np.intp], error: Floats, shift: float, made: Callable[[Floats], Floats]
) -> NDArray[np.bool_]:
    """(M,) intervals with a sample whose error the other side of a tick tells, and of one sample that may be on either;
    of the error, (m,) at `rows`. `made`: what a driver makes."""
    assert h.ticks is not None
    when, value = h.ticks
    many = samples.count[rows]
    row = np.full(samples.count.size, -1)
    row[rows] = np.arange(rows.size)
    which = row[samples.interval]  # of each sample the row that it is in
    at, which = samples.time[which >= 0] - shift, which[which >= 0]
    last = np.clip(np.searchsorted(when, at, side="right") - 1, 0, when.size - 1)
    after = np.minimum(last + 1, when.size - 1)
    seen = made(value)
    std = float(np.median(np.abs(error) * np.sqrt(many))) / 0.6745
    far = (np.abs(error) * np.sqrt(many) > FAR_OFF * std)[which]
    whole = (error * many)[which]  # as though all others are where they should be
    told, either = np.zeros((2, rows.size), dtype=np.bool_)
    for other, apart in ((np.maximum(last - 1, 0), at - when[last]), (after, when[after] - at)):
        jump = seen[other] - seen[last]
        told[which[far & (np.abs(apart) < NEAR) & (np.abs(whole - jump) < TOLD * np.abs(whole))]] = True
        either[which[(np.abs(jump) > std) & (np.abs(apart) < TOO_CLOSE)]] = True
    gone = rows[:0]
    for each, most in ((told, FEW), (either & (many == 1), NOT_ALL)):
        off = rows[each]
        gone = np.concatenate([gone, off]) if off.size <= most * rows.size else gone
    return np.isin(np.arange(samples.count.size), gone)
