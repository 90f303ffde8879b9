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
NOT_ALL = 0.03
"""Of the rows, at most, go: levels that are held near a threshold stay, and the covariance has a stair for each."""


def decided(histories: Sequence[History], twin: Twin) -> tuple[History, ...]:
    """The runs without such rows of thrust and rate."""
    bands = _bands(twin)
    return tuple(_without(h, _between(np.abs(h.driver), bands)) for h in histories) if bands else tuple(histories)


def _bands(twin: Twin) -> list[tuple[float, float]]:
    """Of the driver's size, for each threshold at which the prediction jumps."""
    std = dict(zip(twin.names, np.sqrt(np.diag(np.array(twin.covariance))), strict=True))
    found = []
    for term in (t for t in twin.terms if t.known and t.term.traits.tick_by_tick):
        for p in (p for p in term.term.parameters(term.scale) if p.jumps):
            value, far = term.parameters[p.name], SURELY * float(std[f"{term.effect}.{p.name}"])
            found.append((value - far, value + far))
    return [(low, high) for low, high in found if high > low]


def _between(size: Floats, bands: Sequence[tuple[float, float]]) -> NDArray[np.bool_]:
    """(M,)"""
    out: NDArray[np.bool_] = np.any([(size > low) & (size < high) for low, high in bands], axis=0)
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
