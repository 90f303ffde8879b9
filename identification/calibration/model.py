"""Which terms the steps of a calibration can tell, and the rows of the regression for them.

reading = zero + gain F + even F^2 + odd F|F| + cubic F^3 + lag + remanence + drift t + (zero_temperature +
gain_temperature F) dT + fast (x_1 - r_1) + slow (x_2 - r_2), with x_i the load as a slow part of the cell has followed
it (`steps.crept`) and r_i what it would be at the usual age of a reading under a steady load: the curve is that of such
readings. Two time constants that are given, five times apart, carry a creep of any between and beyond them without a
search, so that what is not known of it is in the covariance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.calibration.steps import Steps, crept, lag_shape, levels, side_of
from identification.recording import Floats

SPARE = 3
"""Steps beyond the terms: one may be wrong, and the scatter is still known."""
WARMED = 1.0
"""K of span from which a temperature coefficient is asked for."""
ZEROS = 3
"""Steps without a load from which a drift of the zero is asked for."""
BENT, CUBIC = 3, 4
"""Loads of a direction from which a bend, and a second one, can be told from the scatter."""
CREEP = {"creep_fast": 1.0, "creep_slow": 5.0}
"""Time constants in ages of a reading."""
POWER = {"gain": 1, "even": 2, "odd": 2, "cubic": 3, "gain_temperature": 1}
"""Of the force in each term: what its unit is made of."""


@dataclass(frozen=True, eq=False)
class Design:
    """Rows for the means of the steps (n, p), and for the change from the first to the last window of each (n, p)."""

    names: tuple[str, ...]
    means: Floats
    changes: Floats
    unit: Floats
    """(p,): what a parameter of these rows is multiplied by to be in SI."""

    def at(self, name: str) -> int:
        return self.names.index(name)


def terms_of(steps: Steps) -> tuple[str, ...]:
    """What can be told, in the order of importance: what comes last is left out first."""
    force = steps.force
    up, down = levels(force, 1), levels(force, -1)
    most, both = max(up, down), min(up, down)
    wanted = ["zero", "gain"]
    if both:
        wanted += ["even"]
    if (both or most) >= BENT:
        wanted += ["odd"] if both else ["even"]
    lag = steps.of_history(lag_shape)
    if np.any(lag > 0.0) and np.any(lag < 0.0):
        wanted += ["lag", "remanence"] if both else ["lag"]
    known = steps.temperature[np.isfinite(steps.temperature)]
    if known.size == steps.count and float(np.ptp(known)) > WARMED:
        wanted += ["zero_temperature", "gain_temperature"]
    elif np.count_nonzero(force == 0.0) >= ZEROS:
        wanted += ["drift"]
    if (both or most) >= CUBIC:
        wanted += ["cubic"]
    return tuple(dict.fromkeys(wanted))[: max(steps.count - SPARE, 2)]


def with_creep(steps: Steps, names: tuple[str, ...]) -> tuple[str, ...]:
    """With its terms where steps were read in two windows at least, and are enough."""
    enough = steps.time.shape[1] > 1 and steps.count >= len(names) + len(CREEP) + SPARE
    return (*names, *CREEP) if enough else names


def design_of(steps: Steps, names: tuple[str, ...]) -> Design:
    """Scaled so that every column is of the size of 1."""
    scale, w = steps.reach, steps.time.shape[1]
    share = (steps.force / scale)[:, None] * np.ones((1, w))
    span = max(float(steps.time.max() - steps.time.min()), 1.0)
    when = (steps.time - steps.time.mean()) / span
    warm = steps.temperature - float(np.mean(steps.temperature))
    warmth = np.nan_to_num(warm)[:, None] * np.ones((1, w))
    shapes = {
        "zero": (np.ones_like(share), 1.0),
        "gain": (share, 1.0 / scale),
        "even": (share**2, 1.0 / scale**2),
        "odd": (share * np.abs(share), 1.0 / scale**2),
        "cubic": (share**3, 1.0 / scale**3),
        "lag": (steps.of_history(lag_shape)[:, None] * np.ones((1, w)), 1.0),
        "remanence": (steps.of_history(side_of)[:, None] * np.ones((1, w)), 1.0),
        "drift": (when, 1.0 / span),
        "zero_temperature": (warmth, 1.0),
        "gain_temperature": (warmth * share, 1.0 / scale),
    }
    for name, ages in CREEP.items():
        shapes[name] = (crept_beyond(steps, ages * steps.age) / scale, 1.0 / scale)
    columns = [shapes[name] for name in names]
    rows = np.stack([column for column, _ in columns], axis=2)
    return Design(names, rows.mean(axis=1), rows[:, -1] - rows[:, 0], np.array([unit for _, unit in columns]))


def crept_beyond(steps: Steps, time_constant: float) -> Floats:
    """(n, w) N: by how much a slow part holds more than under a load that has always been there, at the usual age."""
    usual = steps.force[:, None] * -np.expm1(-steps.age / time_constant)
    return np.asarray(crept(steps, time_constant) - usual)


def straight_line(low: float, high: float) -> Floats:
    """(4,): what each of TERMS adds to the slope of the best straight line through the curve over low..high N.

    >>> straight_line(-10.0, 10.0).round(6).tolist()
    [1.0, 0.0, 7.5, 60.0]
    """
    third = (high**3 - low**3) / 3.0
    fourth, sizes = (high**4 - low**4) / 4.0, (high**4 + low**4) / 4.0
    fifth = (high**5 - low**5) / 5.0
    return np.array([1.0, fourth / third, sizes / third, fifth / third])
