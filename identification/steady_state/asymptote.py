"""Where a hold that is still settling is going: the constant of a + b exp(-t/T), with what it costs to find it.

A hold a few time constants long has no part that is both long enough to average and free of the approach. Cutting ever
more leaves a handful of samples; fitting the approach beside the constant uses them all and needs no luck.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.recording import Floats

CONSTANTS = 24
"""Time constants on the grid."""
LONGEST = 0.5
"""The longest one as a share of the samples: slower ones look like a straight line and leave the constant unknown."""
SHORTEST = 0.03
"""The shortest as a share of the samples: faster ones leave no trace after the cut."""
REFINED, FEWEST_POINTS = 4, 5
"""Grids at most, each between the neighbours of the best of the one before; and likely constants that are enough."""
CREDIBLE = 1e-3
"""Time constants less likely than this, relative to the best, are left out."""


@dataclass(frozen=True, eq=False)
class Asymptote:
    """`value` = weights @ samples for the typical time constant; `spread` comes from not knowing that constant."""

    value: float
    spread: float
    weights: Floats
    """(n,)"""
    basis: Floats
    """(n, 2) orthonormal: what the fit takes out of the samples."""
    approach: Floats
    """(n,) b exp(-t/T): what the samples are above the constant."""


def asymptote(values: Floats) -> Asymptote:
    """Of n >= 8 evenly sampled values, NaN-free. Time constants are weighed as if the noise were white.

    >>> i = np.arange(60)
    >>> found = asymptote(5 + 3 * np.exp(-i / 15) + np.where(i % 2, 0.01, -0.01))
    >>> bool(abs(found.value - 5) < 0.005), bool(found.spread < 0.02)
    (True, True)
    """
    n = values.size
    constants = np.geomspace(SHORTEST * n, LONGEST * n, CONSTANTS)
    for _ in range(REFINED):
        shape, centred, power, size, ends, weight = _weighed(values, constants)
        if np.count_nonzero(weight) >= FEWEST_POINTS:
            break
        best = int(np.argmax(weight))  # a sharp one falls between two of the grid
        constants = np.geomspace(constants[max(best - 1, 0)], constants[min(best + 1, CONSTANTS - 1)], CONSTANTS)
    value = float(weight @ ends)
    near = int(np.argmin(np.where(weight > 0, np.abs(ends - value), np.inf)))
    weights = 1 / n - shape[near].mean() * centred[near] / power[near]
    ones = np.full(n, n**-0.5)
    basis = np.column_stack([ones, centred[near] / np.sqrt(power[near])])
    spread = float(np.sqrt(weight @ np.square(ends - value)))
    return Asymptote(value, spread, weights, basis, size[near] * shape[near])


def _weighed(values: Floats, constants: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    """For each time constant (k,), in samples: its shape (k, n), that less its mean, the power of this, its size, the
    value that it leads to, and how likely it is, by itself."""
    n = values.size
    shape = np.exp(-np.arange(n) / constants[:, None])
    centred = shape - shape.mean(axis=1, keepdims=True)
    power = np.einsum("kn,kn->k", centred, centred)
    size = centred @ (values - values.mean()) / power
    ends = values.mean() - size * shape.mean(axis=1)
    left = np.square(values - values.mean()).sum() - size**2 * power
    left = np.maximum(left, 1e-12 * max(float(np.square(values - values.mean()).sum()), 1e-300))
    log = -0.5 * (n - 3) * np.log(left) - 0.5 * np.log(power)
    weight = np.exp(log - log.max())
    weight[weight < CREDIBLE] = 0.0
    return shape, centred, power, size, ends, weight / weight.sum()
