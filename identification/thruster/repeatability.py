"""How much a thruster's coefficients differ from one recording of it to the next, beyond the scatter in each.

Taking a thruster off and putting it back, another day's water, a warmer motor: what changes between recordings is in no
standard error of a single one. Several recordings of one thruster show it; the excess is one relative standard
deviation, common to all coefficients and thrusters, by Mandel and Paule's rule (Anal. Chem. 1970).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from identification.estimation.verdicts import ALPHA
from identification.thruster.comparison import Group, homogeneity

WIDEST = 1.0
"""Relative: recordings that differ by more than their own size are no repetitions."""


@dataclass(frozen=True, slots=True)
class Repeatability:
    """Of single recordings, relative to the coefficient."""

    std: float
    """0 when the recordings agree within their own scatter."""
    dof: float
    p_value: float
    """Of h0: recordings of one thruster agree."""
    recordings: int

    @property
    def statement(self) -> str:
        seen = f"{self.recordings} recordings, p = {self.p_value:.2g}"
        if self.p_value >= ALPHA:
            return f"recordings of the same thruster agree within their standard errors ({seen})"
        return (
            f"recordings of the same thruster differ by more than their standard errors ({seen}): "
            f"{100 * self.std:.2g} % from one to the next, counted in every comparison"
        )


def _wider(group: Group, std: float) -> Group:
    return replace(group, cov=group.cov + std**2 * np.outer(group.mean, group.mean))


def repeatability(thrusters: Sequence[Sequence[Group]]) -> Repeatability | None:
    """From the recordings (groups) of each thruster; None when no thruster has two.

    >>> groups = [Group("a", ("C",), np.array([c]), np.array([[1e-8]]), 20.0) for c in (0.40, 0.404, 0.398, 0.401)]
    >>> found = repeatability([groups])
    >>> round(found.std, 4), found.dof, found.p_value < 0.001
    (0.0062, 3.0, True)
    """
    several = [groups for groups in thrusters if len(groups) > 1]
    if not several:
        return None

    def surplus(std: float) -> float:
        tests = [homogeneity([_wider(group, std) for group in groups]) for groups in several]
        return sum(test.chi2 - test.dof for test in tests)

    tests = [homogeneity(groups) for groups in several]
    dof = float(sum(len(groups) - 1 for groups in several))
    p_value = min(1.0, len(tests) * min(test.p_value for test in tests))
    std = 0.0
    if surplus(0.0) > 0:
        std = float(brentq(surplus, 0.0, WIDEST)) if surplus(WIDEST) < 0 else WIDEST
    return Repeatability(std, dof, p_value, sum(len(groups) for groups in several))


def with_repeatability(group: Group, found: Repeatability | None) -> Group:
    """The group's mean over its recordings with the excess in its covariance; dof by Welch and Satterthwaite."""
    if found is None or found.std == 0:
        return group
    added = found.std**2 / group.recordings * np.outer(group.mean, group.mean)
    own, extra = float(np.trace(group.cov)), float(np.trace(added))
    dof = (own + extra) ** 2 / (own**2 / group.dof + extra**2 / found.dof)
    return replace(group, cov=group.cov + added, dof=dof)
