"""A vehicle's parameters as a table: value, standard deviation, 95 % interval, unit and what it says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.estimation.maximum_likelihood import Gaussian
from identification.estimation.tails import normal_quantile
from identification.estimation.verdicts import significance
from identification.vehicle.steady_drag import unit_of

COVER_95 = float(normal_quantile(0.975))
CALIBRATION = ("C[", "C+[", "C-[", "thrust[")
"""How names of thruster coefficients begin."""


@dataclass(frozen=True, slots=True)
class Row:
    """One parameter; NaN where the data do not determine it."""

    name: str
    value: float
    std: float
    unit: str
    verdict: str

    @property
    def determined(self) -> bool:
        return bool(np.isfinite(self.std))

    @property
    def low(self) -> float:
        return self.value - COVER_95 * self.std

    @property
    def high(self) -> float:
        return self.value + COVER_95 * self.std


def is_calibration(name: str) -> bool:
    """Whether a parameter is a thruster's, found in the tunnel.

    >>> is_calibration("C[T1]"), is_calibration("eta_hull")
    (True, False)
    """
    return name.startswith(CALIBRATION)


def rows(estimate: Gaussian, axis: str, calibration: bool = False) -> tuple[Row, ...]:
    """The vehicle's own parameters, inertia first; or those of its thrusters."""
    order = {"m": 0, "k": 1, "k2": 2}
    names = [name for name in estimate.names if is_calibration(name) == calibration]
    names.sort(key=lambda name: (order.get(name, len(order)), name if name.startswith("buoyancy") else ""))
    out = []
    for name in names:
        value, std = estimate[name], estimate.std_of(name)
        out.append(Row(name, value, std, unit_of(name, axis), verdict(name, value, std)))
    return tuple(out)


def verdict(name: str, value: float, std: float) -> str:
    """What a parameter says, in a few words.

    >>> verdict("k2", 420.0, 5.0), verdict("k", 3.0, 4.0), verdict("buoyancy[1]", -40.0, 1.0)
    ('significant', 'not told apart from 0 (Indiveri 1998, eq. 4.11)', 'floats')
    >>> verdict("eta_hull", 0.7, 0.02), verdict("m", -3.0, 1.0)
    ('70 % of the calibrated thrust', 'negative: no body has that')
    """
    if not np.isfinite(std):
        return "not determined"
    if is_calibration(name):
        return "as the calibration and these runs have it together"
    seen = significance(value, std).significant
    if name in ("m", "k", "k2") and value < 0:
        return "negative: no body has that"
    if name.startswith("buoyancy"):
        return ("sinks" if value > 0 else "floats") if seen else "not told apart from neutral"
    if name in ("m", "k", "k2", "current_north", "current_east"):
        return "significant" if seen else "not told apart from 0 (Indiveri 1998, eq. 4.11)"
    return _efficiency(value, std)


def _efficiency(value: float, std: float) -> str:
    if not significance(1 - value, std).significant:
        return "not told apart from 1"
    if value > 1:
        return "more than the calibrated thrust: are calibration and lay-out as stated?"
    return f"{100 * value:.0f} % of the calibrated thrust"
