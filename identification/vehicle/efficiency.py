"""Thrusters on a vehicle: what they would give in the tunnel, and how much of it arrives (section 4.2.1).

A thruster near the hull or in another's jet gives less than it did alone in the tunnel. Goheen and Jefferys call the
share that is left the installation coefficient; the thesis estimates it as an efficiency parameter. Which thruster
has which coefficient when is the vehicle's lay-out (fig. 4.3) and data here: an `Interaction`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from identification.estimation.maximum_likelihood import Gaussian
from identification.estimation.verdicts import significance
from identification.recording import Floats
from identification.thruster.thrust import ThrustFit

AXES = ("surge", "sway", "heave", "yaw")


@dataclass(frozen=True, eq=False)
class Thruster:
    """One thruster as calibrated alone, and where it sits.

    `coefficients`: (1,) C of tau = C V|V| (eq. 4.14), N/V^2; (2,) C+ and C-; or, with `levels` (n,) V ascending, the
    thrust (n,) N measured at each level, straight lines between. `arms`: axis -> N (N.m for yaw) on the vehicle per N
    of thrust: the cosine of its direction, the lever for yaw.
    """

    name: str
    coefficients: Floats
    arms: Mapping[str, float]
    levels: Floats | None = None

    def __post_init__(self) -> None:
        unknown = set(self.arms) - set(AXES)
        if unknown:
            raise ValueError(f"thruster {self.name}: axis {sorted(unknown)[0]!r}, expected one of {', '.join(AXES)}")
        count = self.coefficients.size
        if self.levels is None and count not in (1, 2):
            raise ValueError(f"thruster {self.name}: {count} coefficients; expected C, or C+ and C-, or levels too")
        if self.levels is not None and (self.levels.shape != (count,) or np.any(np.diff(self.levels) <= 0)):
            raise ValueError(f"thruster {self.name}: levels must ascend, one for each of {count} thrusts")

    @property
    def names(self) -> tuple[str, ...]:
        """Of its coefficients, as parameters of a fit."""
        if self.levels is not None:
            return tuple(f"thrust[{self.name}@{level:g}]" for level in self.levels)
        return (f"C[{self.name}]",) if self.coefficients.size == 1 else (f"C+[{self.name}]", f"C-[{self.name}]")

    def basis(self, V: Floats) -> Floats:
        """(p, n): thrust at voltages (n,) = coefficients @ basis.

        >>> Thruster("T1", np.array([0.4]), {}).basis(np.array([-2.0, 3.0])).tolist()
        [[-4.0, 9.0]]
        >>> Thruster("T1", np.array([0.0, 8.0]), {}, np.array([0.0, 1.0])).basis(np.array([0.25])).ravel().tolist()
        [0.75, 0.25]
        """
        if self.levels is not None:
            return np.array([np.interp(V, self.levels, row) for row in np.eye(self.levels.size)])
        square: Floats = V * np.abs(V)
        if self.coefficients.size == 1:
            return square[None]
        return np.array([np.maximum(square, 0.0), np.minimum(square, 0.0)])


@dataclass(frozen=True)
class Interaction:
    """One installation coefficient and when it applies. Several that apply at once multiply."""

    name: str
    thrusters: tuple[str, ...]
    direction: int = 0
    """+1: only at positive voltage, -1: only at negative, 0: at either."""
    partner: Mapping[str, str] = field(default_factory=dict)
    """thruster -> another one that must turn too; empty: it need not."""

    def active(self, thruster: str, volts: Mapping[str, Floats]) -> NDArray[np.bool_]:
        """(n,) whether it applies to `thruster`; `volts` (n,) of every thruster."""
        V = volts[thruster]
        if thruster not in self.thrusters:
            return np.zeros(V.shape, dtype=np.bool_)
        on = V != 0 if self.direction == 0 else V * self.direction > 0
        if self.partner:
            other = self.partner.get(thruster)
            on = on & (volts[other] != 0) if other is not None else np.zeros(V.shape, dtype=np.bool_)
        return on


@dataclass(frozen=True, eq=False)
class Installation:
    """All thrusters of a vehicle, the covariance of their coefficients (p, p) in order, and their interactions.

    Thrusters calibrated on one cell share its gain error: the covariance is then not diagonal, and an error in one
    run's force is an error in every run's.
    """

    thrusters: tuple[Thruster, ...]
    cov: Floats
    interactions: tuple[Interaction, ...] = ()

    def __post_init__(self) -> None:
        p = len(self.names)
        if self.cov.shape != (p, p):
            raise ValueError(f"Installation: {p} coefficients need a covariance ({p}, {p}), got {self.cov.shape}")
        known = {thruster.name for thruster in self.thrusters}
        for found in self.interactions:
            strangers = {*found.thrusters, *found.partner, *found.partner.values()} - known
            if strangers:
                raise ValueError(f"{found.name}: no thruster {sorted(strangers)[0]!r}; there are {sorted(known)}")

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(name for thruster in self.thrusters for name in thruster.names)

    @property
    def coefficients(self) -> Floats:
        return np.concatenate([thruster.coefficients for thruster in self.thrusters])

    @property
    def etas(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(found.name for found in self.interactions))

    def known(self, names: Iterable[str]) -> Gaussian:
        """Those of `names` that are coefficients with a stated uncertainty."""
        uncertain = dict(zip(self.names, np.diag(self.cov) > 0, strict=True))
        wanted = [name for name in names if uncertain.get(name, False)]
        return Gaussian(self.names, self.coefficients, self.cov).select(wanted)


@dataclass(frozen=True, eq=False)
class Force:
    """Force on one axis over n instants: the sum of coefficient x product of its etas x signal. T terms."""

    coefficients: tuple[str, ...]
    """(T) name of the coefficient of each term."""
    etas: tuple[tuple[str, ...], ...]
    """(T) names of the efficiencies that multiply it."""
    signal: Floats
    """(T, n) arm x basis; N per unit of the coefficient."""
    values: Floats
    """(T,) of the coefficients as calibrated."""

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of all efficiencies and coefficients in it, each once."""
        return tuple(dict.fromkeys([name for group in self.etas for name in group] + list(self.coefficients)))

    def weights(self, names: Sequence[str], theta: Floats) -> Floats:
        """(k, T) factors of the signals for parameter sets theta (k, p); what is not among `names` stays as it was."""
        at = {name: i for i, name in enumerate(names)}
        out: Floats = np.ones((theta.shape[0], len(self.coefficients)))
        for t, (coefficient, group) in enumerate(zip(self.coefficients, self.etas, strict=True)):
            out[:, t] = theta[:, at[coefficient]] if coefficient in at else self.values[t]
            for eta in group:
                if eta in at:
                    out[:, t] *= theta[:, at[eta]]
        return out

    def nominal(self) -> Floats:
        """(n,) what the calibration alone promises: every efficiency 1."""
        out: Floats = self.values @ self.signal
        return out


def force_on(installation: Installation, axis: str, volts: Mapping[str, Floats]) -> Force:
    """Terms of the force on `axis` at voltages (n,) of every thruster; terms that are zero throughout are left out."""
    coefficients: list[str] = []
    groups: list[tuple[str, ...]] = []
    signals, values = [], []
    n = next(iter(volts.values())).size
    for thruster in installation.thrusters:
        arm = thruster.arms.get(axis, 0.0)
        if arm == 0.0:
            continue
        state = np.array([i.active(thruster.name, volts) for i in installation.interactions]).reshape(-1, n)
        basis = arm * thruster.basis(volts[thruster.name])
        for pattern in np.unique(state, axis=1).T:
            here = np.all(state == pattern[:, None], axis=0)
            group = tuple(i.name for i, on in zip(installation.interactions, pattern, strict=True) if on)
            for name, value, row in zip(thruster.names, thruster.coefficients, basis, strict=True):
                if np.any(row[here] != 0):
                    coefficients.append(name)
                    groups.append(group)
                    signals.append(np.where(here, row, 0.0))
                    values.append(float(value))
    signal = np.array(signals).reshape(-1, n)
    return Force(tuple(coefficients), tuple(groups), signal, np.array(values))


def calibrated(fits: Sequence[ThrustFit]) -> Gaussian:
    """Coefficients of tunnel fits with their covariance: scatter of each fit, and the gain of the cell common to all.

    Parameters are named as `Thruster.names` does.
    """
    names, values, statistical, common = [], [], [], []
    for fit in fits:
        for name, found in fit.parameters.items():
            names.append(f"{name.replace('_plus', '+').replace('_minus', '-')}[{fit.thruster}]")
            values.append(found.value)
            statistical.append(found.std_statistical**2)
            common.append(found.std_calibration * np.sign(found.value))
    shared = np.array(common)
    return Gaussian(tuple(names), np.array(values), np.diag(statistical) + np.outer(shared, shared))


def efficiency_sentence(name: str, value: float, std: float) -> str:
    """What an installation coefficient says.

    >>> efficiency_sentence("eta_hull", 0.6, 0.02)
    'eta_hull = 0.600 ± 0.020: the thrusters it applies to give 60 % of their thrust in the tunnel'
    """
    if not np.isfinite(std):
        return f"{name}: not determined"
    text = f"{name} = {value:.3f} ± {std:.3f}"
    if not significance(1 - value, std).significant:
        return f"{text}: not told apart from 1, the thrust measured in the tunnel"
    if value > 1:
        return f"{text}: more thrust than in the tunnel; ask whether calibration or lay-out are as stated"
    return f"{text}: the thrusters it applies to give {100 * value:.0f} % of their thrust in the tunnel"
