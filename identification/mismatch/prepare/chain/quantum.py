"""The step in which a channel's values come: as its recording states it, or as they lie on a lattice."""

from __future__ import annotations

import numpy as np

from identification.recording import Channel

OFF_LATTICE = 0.02
"""Steps by which a value may be off the lattice: files have few digits."""
LEAST_VALUES = 4
"""Distinct values, below which they are a lattice by chance."""
DISTINCT = 1e-9
"""Of the largest value: what is nearer differs by the rounding of a computation."""


def quantum_of(channel: Channel) -> float:
    """The step in the channel's unit; 0 where none is stated and the values are not whole steps apart."""
    if channel.acquisition.quantum:
        return channel.acquisition.quantum
    values = np.unique(channel.value[np.isfinite(channel.value)])
    apart = np.diff(values)
    apart = apart[apart > DISTINCT * np.max(np.abs(values), initial=0.0)]
    if apart.size + 1 < LEAST_VALUES:
        return 0.0
    step = float(np.mean(apart[apart < (1 + OFF_LATTICE) * np.min(apart)]))
    steps = np.diff(values) / step
    return step if float(np.max(np.abs(steps - np.round(steps)))) < OFF_LATTICE else 0.0
