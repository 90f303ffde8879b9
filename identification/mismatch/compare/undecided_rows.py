"""Rows of which a twin does not know on which side of its threshold they are.

A rotor turns there or stands still, which is the whole of its rate, and a covariance says nothing of an either-or: on a
ramp past a threshold known to 66 mV four samples that the twin had turning outweighed all other evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats
from identification.run_history.history import History
from identification.twin import Twin

SURELY = 4.0
"""Standard deviations of the threshold: farther off the twin knows."""
HELD = 0.5
"""s: a level that is held longer stays, and the covariance has stairs for such."""
NOT_ALL = 0.1
"""Of the rows, at most, go."""


def decided(histories: Sequence[History], twin: Twin) -> tuple[History, ...]:
    """The runs without such rows of thrust and rate."""
    bands = _bands(twin)
    return tuple(_without(h, _moving(h) & _between(np.abs(h.driver), bands)) for h in histories)


def _bands(twin: Twin) -> list[tuple[float, float]]:
    """Of the driver's size, for each threshold at which the prediction jumps."""
    std = np.sqrt(np.diag(np.array(twin.covariance)))
    found, at = [], 1  # C comes first
    for term in twin.terms:
        if term.known and term.term.traits.tick_by_tick:
            far = SURELY * std[at : at + len(term.values)]
            known = zip(term.term.parameters(term.scale), term.values, far.tolist(), strict=True)
            found += [(value - most, value + most) for p, value, most in known if p.jumps and most > 0]
        at += len(term.parameters)
    return found


def _moving(history: History) -> NDArray[np.bool_]:
    """(M,) whether the command goes on soon."""
    if history.ticks is None:
        return np.zeros(history.driver.size, dtype=np.bool_)
    when = history.ticks[0]
    last = np.clip(np.searchsorted(when, history.middle, side="right") - 1, 0, when.size - 1)
    return np.diff(when, append=np.inf)[last] < HELD


def _between(size: Floats, bands: Sequence[tuple[float, float]]) -> NDArray[np.bool_]:
    """(M,)"""
    out = np.zeros(size.size, dtype=np.bool_)
    for low, high in bands:
        out |= (size > low) & (size < high)
    return out


def _without(history: History, gone: NDArray[np.bool_]) -> History:
    told = np.count_nonzero(gone & (history.count > 0))
    if told == 0 or told > NOT_ALL * np.count_nonzero(history.count):
        return history
    out = replace(history, count=np.where(gone, 0, history.count), thrust=np.where(gone, np.nan, history.thrust))
    if history.rate is None or history.rate_count is None:
        return out
    counted = np.where(gone, 0, history.rate_count)
    return replace(out, rate=np.where(gone, np.nan, history.rate), rate_count=counted)
