"""What the noise of stretch means may be like: a grid of laws, each white + slow + one deviation per level.

All are relative to the white variance of a mean over REFERENCE s at rest, whose size stays unknown (see evidence).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from identification.recording import Floats

REFERENCE = 4.0
"""s of samples in a mean of unit white variance."""
TIMES = (8.0, 30.0, 100.0)
"""s: time constants of the slow parts, first-order Gauss-Markov each. What is slower is called drift, not noise."""
RATIOS = (1.0, 10.0, 100.0, 1000.0)
"""Variance of the slow part over the white one. A decade between neighbours: the truth is at most sqrt(10) away."""
LEVELS = (0.0, 9.0, 900.0)
"""Variance of the deviation of a level from the smooth static curve over the white one: friction, settling, shape."""

KNOWN_LEVELS = LEVELS[:2]
"""The same for a model known before the run, whose deviations of shape are allowed for apart."""


@dataclass(frozen=True, eq=False, slots=True)
class Laws:
    """H laws."""

    slow: Floats
    """(H, len(TIMES)) variance of each slow part."""
    level: Floats
    """(H,) variance of each level's own deviation."""


def laws(levels: tuple[float, ...] = LEVELS) -> Laws:
    """White alone; one slow part of each time and ratio; equal parts at all times, which is 1/f noise.

    >>> laws().slow.shape
    (51, 3)
    """
    m = len(TIMES)
    shapes = [np.eye(m)[i] for i in range(m)] + [np.full(m, 1.0 / m)]
    slow = [np.zeros(m)] + [ratio * shape for shape, ratio in product(shapes, RATIOS)]
    both = list(product(slow, levels))
    return Laws(np.array([s for s, _ in both]), np.array([level for _, level in both]))
