"""What warm copper costs a motor fed with a voltage: a share of its thrust at the largest one.

e is the rate in volts that the cold motor has there, w in 1/V what its winding takes: V = e + w e^2; warm, y + w (1 +
copper dT) y^2 is the same (the world's Heating). Where another term says what is in series, cold, that is `series`, and
w is only what warms: V = e + series e^2, and y + (series + w copper dT) y^2.
"""

from __future__ import annotations

from scipy.optimize import brentq

COPPER = 0.0039
"""1/K: the world's, where it is not said."""


def loss_per_kelvin(w: float, cold: float, copper: float = COPPER, series: float | None = None) -> float:
    """1/K of the first kelvin.

    >>> round(loss_per_kelvin(0.3125, 0.8), 6)  # a fifth of 1 V in the cold winding
    0.0013
    """
    return 2.0 * w * cold * copper / (1.0 + 2.0 * (w if series is None else series) * cold)


def loss_at_full(w: float, cold: float, rise: float, copper: float = COPPER, series: float | None = None) -> float:
    """Held there for long. `rise` in K is what the current of the cold motor would warm it by; the warm one draws less.

    >>> round(loss_at_full(0.3125, 0.8, 40.0), 4), round(loss_at_full(0.3125, 0.8, 44.2), 4)
    (0.045, 0.049)
    """
    before = w if series is None else series
    terminals = cold + before * cold**2

    def left(y: float) -> float:
        return y + (before + w * copper * rise * (y / cold) ** 4) * y**2 - terminals

    return float(1.0 - (brentq(left, 0.0, cold, xtol=1e-12 * cold) / cold) ** 2)
