"""Are thrusters alike, and has one changed? Tests, effect sizes and the smallest change that could have been seen.

A load cell's gain error multiplies all that it measured: where thrusters share the calibration it cancels in ratios and
must not enter the comparison; where they do not, it enters each side once. What is left has standard errors with their
own finite degrees of freedom, so chi-square is replaced by Johansen's F (Biometrika 1980), which for one coefficient is
Welch's (Biometrika 1951). Pairs: Welch's t, made to hold for all pairs at once by Holm (Scand. J. Stat. 1979).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.optimize import brentq

from identification.estimation.tails import chi2_sf, fisher_sf, normal_sf, student_quantile, student_sf
from identification.estimation.verdicts import ALPHA
from identification.recording import Floats

POWER = 0.8
"""Chance with which "could have been seen" is meant (Cohen 1988)."""
MANY = 1e6
"""Degrees of freedom from which on a t is a normal deviate."""


@dataclass(frozen=True, eq=False)
class Group:
    """Coefficients of one thruster, or of one recording: mean (p,), cov (p, p) of its scatter, dof behind it."""

    name: str
    coefficients: tuple[str, ...]
    mean: Floats
    cov: Floats
    dof: float
    gain_std: float = 0.0
    """Relative standard uncertainty of the cell's gain, not in `cov`."""
    calibration: str = ""
    """Groups with the same text share the gain error; with an empty one nobody knows."""
    recordings: int = 1


def with_gain(group: Group) -> Group:
    """The gain error counted as the group's own."""
    cov = group.cov + group.gain_std**2 * np.outer(group.mean, group.mean)
    before, after = float(np.trace(group.cov)), float(np.trace(cov))
    return replace(group, cov=cov, dof=group.dof * (after / before) ** 2 if before > 0 else MANY, gain_std=0.0)


def share_calibration(groups: Sequence[Group]) -> bool:
    """All measured with one cell under one calibration."""
    return len({group.calibration for group in groups}) == 1 and bool(groups[0].calibration)


def comparable(groups: Sequence[Group]) -> tuple[Group, ...]:
    """Without the gain error where it is common to all, with it as each one's own where it is not."""
    if share_calibration(groups):
        return tuple(groups)
    return tuple(with_gain(group) for group in groups)


@dataclass(frozen=True, eq=False)
class Homogeneity:
    """Test of h0: all groups have the same coefficients."""

    chi2: float
    """Weighted sum of squares about the common mean."""
    F: float
    """chi2 / its mean under h0 for the dof of the standard errors (Johansen's c)."""
    dof: float
    dof_error: float
    p_value: float
    common: Floats
    """(p,) weighted mean."""
    cov: Floats
    """(p, p) of the common mean."""

    @property
    def differ(self) -> bool:
        return self.p_value < ALPHA


def homogeneity(groups: Sequence[Group]) -> Homogeneity:
    """Johansen's test. ValueError for fewer than two groups, or coefficients that are not the same.

    >>> one = Group("T1", ("C",), np.array([0.40]), np.array([[1e-6]]), 20.0)
    >>> other = replace(one, name="T2", mean=np.array([0.41]))
    >>> homogeneity([one, one]).differ, homogeneity([one, other]).differ
    (False, True)
    """
    if len(groups) < 2 or len({group.coefficients for group in groups}) != 1:
        raise ValueError("homogeneity: expected two or more groups with the same coefficients")
    p, k = groups[0].mean.size, len(groups)
    weights = [np.linalg.inv(group.cov) for group in groups]
    cov = np.linalg.inv(np.sum(weights, axis=0))
    common = cov @ np.sum([W @ g.mean for W, g in zip(weights, groups, strict=True)], axis=0)
    chi2 = float(sum((g.mean - common) @ W @ (g.mean - common) for W, g in zip(weights, groups, strict=True)))
    dof, A = float(p * (k - 1)), 0.0
    for W, g in zip(weights, groups, strict=True):
        left = np.eye(p) - cov @ W
        A += (float(np.trace(left @ left)) + float(np.trace(left)) ** 2) / (2 * g.dof)
    c = dof + 2 * A - 6 * A / (dof + 2)
    dof_error = dof * (dof + 2) / (3 * A) if A > 0 else float("inf")
    F = chi2 / c
    p_value = float(fisher_sf(F, dof, dof_error)) if dof_error < MANY else float(chi2_sf(F * dof, dof))
    return Homogeneity(chi2, F, dof, dof_error, p_value, common, cov)


@dataclass(frozen=True, slots=True)
class Difference:
    """Of one coefficient between two sides: `value` = second - first, with its interval of the stated coverage."""

    first: str
    second: str
    coefficient: str
    value: float
    std: float
    dof: float
    low: float
    high: float
    relative: float
    """value / first."""
    relative_low: float
    relative_high: float
    p_value: float

    @property
    def differ(self) -> bool:
        return self.p_value < ALPHA


def _welch(a: Group, b: Group, i: int) -> tuple[float, float, float]:
    """Difference of coefficient i, its standard deviation and Welch's degrees of freedom."""
    va, vb = float(a.cov[i, i]), float(b.cov[i, i])
    doubt = va**2 / a.dof + vb**2 / b.dof
    dof = (va + vb) ** 2 / doubt if doubt > 0 else float("inf")
    return float(b.mean[i] - a.mean[i]), float(np.sqrt(va + vb)), dof


def _ratio_interval(a: Group, b: Group, i: int, t: float) -> tuple[float, float]:
    """Fieller's interval of b / a - 1; (-inf, inf) where a itself may be zero."""
    x, y, vx, vy = float(a.mean[i]), float(b.mean[i]), float(a.cov[i, i]), float(b.cov[i, i])
    g = t * t * vx / x**2 if x else np.inf
    if not g < 1:
        return -np.inf, np.inf
    half = t / abs(x) * np.sqrt(max(vy + (y / x) ** 2 * vx - g * vy, 0.0)) / (1 - g)
    middle = y / x / (1 - g)
    return float(middle - half - 1), float(middle + half - 1)


def difference(a: Group, b: Group, i: int = 0, *, of: int = 1) -> Difference:
    """Coefficient i of b less that of a by Welch's t; the interval holds for `of` such differences together."""
    value, std, dof = _welch(a, b, i)
    few = min(dof, MANY)
    ratio = abs(value) / std if std > 0 else (np.inf if value else 0.0)
    t, p_value = float(student_quantile(1 - ALPHA / (2 * of), few)), float(2 * student_sf(ratio, few))
    first = float(a.mean[i])
    relative = value / first if first else float("nan")
    low, high = _ratio_interval(a, b, i, t)
    return Difference(
        a.name, b.name, a.coefficients[i], value, std, dof, value - t * std, value + t * std, relative, low, high,
        p_value,
    )  # fmt: skip


def pairs(groups: Sequence[Group]) -> tuple[Difference, ...]:
    """All pairs, all coefficients. Intervals (Bonferroni) and p values (Holm) hold for all of them at once."""
    both = list(combinations(groups, 2))
    count = groups[0].mean.size
    found = [difference(a, b, i, of=len(both) * count) for a, b in both for i in range(count)]
    adjusted = holm([d.p_value for d in found])
    return tuple(replace(d, p_value=p) for d, p in zip(found, adjusted, strict=True))


def odd_ones(groups: Sequence[Group]) -> tuple[tuple[str, ...], Homogeneity | None]:
    """Names of those that differ from the rest, most different first, and the test of the rest (None: no rest is left).

    While the groups differ, the one without which they differ least is taken out. The first test guards all: where none
    differs, one is named in `ALPHA` of the cases. When half of them had to go there is no rest to differ from.
    """
    left = list(groups)
    out: list[str] = []
    found = homogeneity(left)
    while found.differ:
        if len(left) == 2 or len(out) + 1 > len(groups) // 2:
            return (), None
        rests = [homogeneity([g for g in left if g is not one]) for one in left]
        at = int(np.argmin([rest.F for rest in rests]))
        out.append(left.pop(at).name)
        found = rests[at]
    return tuple(out), found


def smallest_change(std: float, dof: float, power: float = POWER) -> float:
    """Smallest true difference that a t test at `ALPHA` sees with that chance; `std` of the measured difference.

    >>> round(smallest_change(1.0, 1e9), 2), round(smallest_change(1.0, 5.0), 2)
    (2.8, 3.51)
    """
    from scipy.stats import nct  # half a second, for comparisons alone

    if not std > 0:
        return 0.0 if std == 0 else float("nan")
    few = min(dof, MANY)
    t = float(student_quantile(1 - ALPHA / 2, few))

    def surplus(shift: float) -> float:
        seen = normal_sf(t - shift) if few >= MANY else nct.sf(t, few, shift)
        return float(seen) - power  # the other tail holds less than 1e-4

    return std * float(brentq(surplus, 0.0, 2 * t + 10, rtol=1e-6))


@dataclass(frozen=True, slots=True)
class Change:
    """One coefficient of one thruster, from an earlier campaign to this one."""

    difference: Difference
    adjusted_p: float
    """Holm's, for all that was asked together."""

    @property
    def smallest(self) -> float:
        """Unit of the coefficient: the true change that this pair of campaigns would see in `POWER` of all cases."""
        return smallest_change(self.difference.std, self.difference.dof)

    @property
    def changed(self) -> bool:
        return self.adjusted_p < ALPHA


def holm(p_values: Sequence[float]) -> list[float]:
    """Adjusted p values: the chance of one false alarm among all stays what it says.

    >>> holm([0.01, 0.04, 0.5])
    [0.03, 0.08, 0.5]
    """
    out, worst = [0.0] * len(p_values), 0.0
    for rank, i in enumerate(np.argsort(p_values, kind="stable").tolist()):
        worst = max(worst, min((len(p_values) - rank) * p_values[i], 1.0))
        out[i] = worst
    return out


def changes(pairs_of: Sequence[tuple[Group, Group]]) -> tuple[Change, ...]:
    """Each (earlier, now) pair, each coefficient; the gain of the cell counts unless both share the calibration."""
    found = []
    for pair in pairs_of:
        old, new = comparable(pair)
        found += [difference(old, new, i) for i in range(old.mean.size)]
    adjusted = holm([d.p_value for d in found])
    return tuple(Change(d, p) for d, p in zip(found, adjusted, strict=True))
