"""A number with its uncertainty, and a stretch of what was recorded: what all rooms state results in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite, isnan

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.recording import Floats

QUANTILE = 1.959964
"""Standard errors to the end of a 95 % interval."""


@dataclass(frozen=True, slots=True)
class Value:
    """A number that was measured, with its unit and how far it may be off."""

    value: float
    std: float
    """Such that value +- 1.96 std holds the whole 95 % interval."""
    unit: str
    ends: tuple[float, float] | None = None
    """Of the 95 % interval, where it is not value +- 1.96 std."""
    limits: tuple[float, float] | None = None
    """What it could be before anything was measured: the bounds of the physics, or the reach of what is measured."""
    told: str = ""
    """As a noun in a sentence; empty: the name under which it stands says it."""

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval, within what is possible where the data do not determine the value; NaN where no error is
        known: it was not estimated, or ended at a bound."""
        half = QUANTILE * self.std
        low, high = self.ends or (self.value - half, self.value + half)
        if self.limits is None or self.determined:
            return low, high
        a, b = self.limits
        return (max(low, a), min(high, b)) if max(low, a) < min(high, b) else (a, b)

    @property
    def determined(self) -> bool:
        """Whether the data say more of it than what it could be at all; without an error nobody knows better.

        >>> [Value(24.0, std, "s", limits=(1.0, 400.0)).determined for std in (3.0, 5.8e9)]
        [True, False]
        """
        if isnan(self.std) or self.std <= 0:
            return True
        if self.limits is not None:
            low, high = self.limits
            if unknown(self.std, low, high) or (self.ends is not None and self.ends[0] <= low and self.ends[1] >= high):
                return False
        one_sided = self.limits is None or self.limits[0] >= 0 or self.limits[1] <= 0
        return not one_sided or self.std <= policy.answer.LOST_ERRORS * abs(self.value) or self.value == 0


def unknown(std: float, low: float, high: float) -> bool:
    """Whether a number with this standard error is known no better than that it lies between `low` and `high`."""
    return not isfinite(std) or std > policy.answer.UNIFORM_ERROR * (high - low)


def told_rows(value: Floats, std: Floats) -> NDArray[np.bool_]:
    """Which rows (n,) of a table of a shape say anything of it: those whose error does not exceed what a number between
    -+ the largest that any row is sure of would have. All that have an error where no row is sure of anything.

    >>> told_rows(np.array([1.0, -2.0, -44.7]), np.array([0.2, 0.3, 55.0])).tolist()
    [True, True, False]
    """
    known = np.isfinite(value) & np.isfinite(std)
    sure = known & (np.abs(value) > policy.answer.SURE_SIGMA * std)
    if not sure.any():
        return known
    reach = float(np.max(np.abs(value[sure])))
    return np.asarray(known & ((std <= policy.answer.UNIFORM_ERROR * 2 * reach) | sure))


def of_shape(coefficients: Mapping[str, Value]) -> dict[str, Value]:
    """A spline's values, each of which could be anything within -+ the largest of its unit that is sure."""
    out = {}
    for name, v in coefficients.items():
        alike = [each for each in coefficients.values() if each.unit == v.unit]
        sure = [abs(each.value) for each in alike if abs(each.value) > policy.answer.SURE_SIGMA * each.std]
        out[name] = replace(v, limits=(-max(sure), max(sure))) if sure else v
    return out


@dataclass(frozen=True, slots=True)
class Where:
    """A stretch of a quantity of recording-format.md, or of time, time_since_step, previous_voltage, direction ..."""

    quantity: str
    low: float
    high: float
    unit: str
