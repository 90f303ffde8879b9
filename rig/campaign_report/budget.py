"""The uncertainty budget of a fitted coefficient: contributions, combined and expanded, after JCGM 100:2008 (GUM).

The parts are the fit's own: its statistical covariance, of which the tare's share is what would go if the tare were
known (the Schur complement), and the load cell's gain, which multiplies everything alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, isfinite, sqrt
from typing import Final, Literal

import numpy as np

from identification.recording import Recording
from identification.thruster.thrust import Parameter, ThrustFit
from identification.thruster.thrust_data import gain_std

COVERAGE: Final = 2.0
"""Coverage factor k: about 95 % for a normal error (JCGM 100:2008, 6.2.3 and G.1.3)."""


@dataclass(frozen=True, slots=True)
class Contribution:
    """One source of uncertainty; `u` is its standard uncertainty in the unit of the coefficient."""

    source: str
    kind: Literal["A", "B"]
    u: float
    basis: str
    """What it is known from."""


@dataclass(frozen=True, slots=True)
class Budget:
    """Of one coefficient, in its unit."""

    name: str
    value: float
    unit: str
    contributions: tuple[Contribution, ...]
    dof: float
    """Effective degrees of freedom (Welch-Satterthwaite); inf where type B is all of it."""
    low: float
    high: float
    """95 % interval by the t quantile of these degrees of freedom, as `rig fit` gives it."""
    open: tuple[str, ...] = ()
    """Sources that nothing is stated of, a sentence each."""

    @property
    def u(self) -> float:
        """Combined standard uncertainty."""
        return hypot(*(each.u for each in self.contributions))

    @property
    def expanded(self) -> float:
        """U = k u."""
        return COVERAGE * self.u

    def share(self, part: Contribution) -> float:
        """% of the combined variance."""
        return 100 * part.u**2 / self.u**2 if self.u > 0 else 0.0


def budgets(fit: ThrustFit, recordings: Sequence[Recording]) -> tuple[Budget, ...]:
    """One for each coefficient of the model whose scatter is known."""
    found = [_budget(fit, i, name, p, recordings) for i, (name, p) in enumerate(fit.parameters.items())]
    return tuple(each for each in found if each is not None)


def _budget(fit: ThrustFit, i: int, name: str, p: Parameter, recordings: Sequence[Recording]) -> Budget | None:
    if not (isfinite(p.value) and isfinite(p.std)):
        return None
    tare = _through_tares(fit, i)
    points = fit.estimate.rows.y.size
    parts = [
        Contribution(
            "scatter about the curve", "A", sqrt(max(p.std_statistical**2 - tare**2, 0.0)), f"{points} {fit.rmse_of}"
        ),
        Contribution("tare", "A", tare, "fitted with the coefficient"),
    ]
    missing = []
    if p.std_calibration > 0:
        gain = max(run.gain_std for run in fit.runs)
        parts.append(Contribution("gain of the load cell", "B", p.std_calibration, f"gain_std = {gain:g}"))
    else:
        missing.append("The calibration of the load cell states no gain_std: its gain is not in this sum.")
    voltage = _of_level(fit, recordings)
    if voltage > 0:
        parts.append(
            Contribution("voltage" if _by_voltage(fit) else "rotation rate", "B", 2 * voltage * abs(p.value),
                         f"gain_std = {voltage:g}, twice, for the thrust goes with its square"),
        )  # fmt: skip
    else:
        what = fit.voltage_quantity.replace("_", " ")
        missing.append(
            f"Nothing is stated of the error of the {what}: it is not in this sum. 1 % of it would be 2 % of {name}."
        )
    return Budget(name, p.value, p.unit, tuple(parts), p.dof, p.low, p.high, tuple(missing))


def _through_tares(fit: ThrustFit, i: int) -> float:
    """Standard uncertainty that coefficient `i` has since the tares are fitted with it."""
    first = len(fit.parameters)
    cov = fit.cov_statistical
    across, own = cov[i, first:], cov[first:, first:]
    if not (np.all(np.isfinite(across)) and np.all(np.isfinite(own))):
        return 0.0
    return sqrt(max(float(across @ np.linalg.pinv(own, hermitian=True) @ across), 0.0))


def _of_level(fit: ThrustFit, recordings: Sequence[Recording]) -> float:
    """Relative standard uncertainty of the gain of what explains the thrust; 0 where it is not stated."""
    channels = [recording.first_of(fit.voltage_quantity) for recording in recordings]
    return max((gain_std(channel) for channel in channels if channel is not None), default=0.0)


def _by_voltage(fit: ThrustFit) -> bool:
    return fit.voltage_quantity != "rotation_rate"
