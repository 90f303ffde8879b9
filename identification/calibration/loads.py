"""Force of dead weights and what it is uncertain by, each source by itself, after the GUM (JCGM 100:2008, 5).

A weight of the conventional mass m (OIML D 28: as if of 8000 kg/m^3, in air of 1.2 kg/m^3) and the density rho pulls
with m g (1 - 1.2/8000) (1 - rho_air/rho) / (1 - 1.2/rho). A lever multiplies it. What two loads share (a weight that
hangs in both, the reference that all weights of a set were compared with, g, the lever) is correlated between them:
a source is therefore a matrix B, and the covariance of the forces that it makes is B B'.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite, radians, sin, sqrt

import numpy as np

from identification.recording import Floats

CONVENTIONAL_AIR = 1.2
"""kg/m^3 (OIML D 28:2004, 5)."""
CONVENTIONAL_DENSITY = 8000.0
"""kg/m^3 (the same)."""
ANOMALY = 3e-4
"""m/s^2, 1 sigma: gravity of a place about that of its latitude and height; anomalies on land reach 5e-4 and more in
mountains (Torge, Geodesy, 2001, 6.5.3)."""


@dataclass(frozen=True, slots=True)
class Weight:
    """One piece of a set, as its certificate has it."""

    name: str
    mass: float
    """kg, conventional."""
    std: float
    """kg, standard uncertainty: U/k of a certificate, or the tolerance of its class over sqrt 3."""
    density: float = CONVENTIONAL_DENSITY
    """kg/m^3"""
    density_std: float = 0.0
    """kg/m^3, standard uncertainty; a set is of one material, so that all its pieces share the error."""

    def __post_init__(self) -> None:
        if not (isfinite(self.mass) and self.mass > 0.0 and isfinite(self.std) and self.std >= 0.0):
            raise ValueError(f"weight {self.name}: mass must be above 0 kg and std at least 0 kg")
        if not (self.density > 100.0 and self.density_std >= 0.0):
            raise ValueError(f"weight {self.name}: density must be above 100 kg/m^3 (steel 8000), its std at least 0")


@dataclass(frozen=True, slots=True)
class Place:
    """Where they hang, and through what they pull."""

    gravity: float
    """m/s^2"""
    gravity_std: float = 0.0
    air_density: float = CONVENTIONAL_AIR
    """kg/m^3"""
    air_density_std: float = 0.04
    """kg/m^3: weather and 10 K of room temperature."""
    lever: float = 1.0
    """Force on the cell over force of the weight."""
    lever_std: float = 0.0

    def __post_init__(self) -> None:
        if not 9.7 < self.gravity < 9.9:
            raise ValueError(f"gravity must be between 9.7 and 9.9 m/s^2, but is {self.gravity:g}")
        if not self.lever > 0.0:
            raise ValueError(f"lever must be above 0, but is {self.lever:g}; a load's direction gives its sign")
        if not 0.0 <= self.air_density < 2.0:
            raise ValueError(f"air_density must be between 0 and 2 kg/m^3, but is {self.air_density:g}")
        if min(self.gravity_std, self.air_density_std, self.lever_std) < 0.0:
            raise ValueError("standard uncertainties must be at least 0")


@dataclass(frozen=True, slots=True)
class Load:
    """What hangs in one step, and which way it pulls."""

    weights: tuple[str, ...] = ()
    """Names of the set; none: no load."""
    direction: int = 1
    """+1: the cell reads it as forward thrust."""

    def __post_init__(self) -> None:
        if self.direction not in (1, -1):
            raise ValueError(f"direction must be 1 or -1, but is {self.direction}")
        if len(set(self.weights)) != len(self.weights):
            raise ValueError(f"a weight hangs twice in one load: {', '.join(self.weights)}")

    @property
    def said(self) -> str:
        """As a person names it."""
        if not self.weights:
            return "no load"
        return " + ".join(self.weights) + (" backward" if self.direction < 0 else "")


@dataclass(frozen=True, eq=False)
class Source:
    """One reason why the forces are uncertain: their covariance by it is `effect @ effect.T`."""

    name: str
    effect: Floats
    """(n, q) N"""
    dof: float = inf
    """Degrees of freedom of its standard uncertainty (JCGM 100, G.4.2)."""


@dataclass(frozen=True, eq=False)
class Forces:
    """Of (n,) loads, N, and why they are uncertain."""

    value: Floats
    sources: tuple[Source, ...] = field(default=())

    @property
    def cov(self) -> Floats:
        """(n, n) N^2"""
        out = np.zeros((self.value.size, self.value.size))
        for source in self.sources:
            out += source.effect @ source.effect.T
        return out


def gravity_at(latitude: float, height: float = 0.0) -> tuple[float, float]:
    """m/s^2 and its standard uncertainty, at `latitude` in degrees and `height` in m above the sea.

    Somigliana's formula of the Geodetic Reference System 1980 (Moritz 2000) and the free-air gradient.

    >>> [round(value, 5) for value in gravity_at(52.3, 80.0)]
    [9.81249, 0.0003]
    """
    if not -90.0 <= latitude <= 90.0:
        raise ValueError(f"latitude must be between -90 and 90 degrees, but is {latitude:g}")
    square = sin(radians(latitude)) ** 2
    level = 9.7803267715 * (1.0 + 0.001931851353 * square) / sqrt(1.0 - 0.0066943800229 * square)
    return level - 3.086e-6 * height, ANOMALY


def newtons_per_kilogram(weight: Weight, place: Place) -> float:
    """Force on the cell by 1 kg of such a weight, N/kg."""
    buoyancy = 1.0 - place.air_density / weight.density
    conventional = (1.0 - CONVENTIONAL_AIR / CONVENTIONAL_DENSITY) / (1.0 - CONVENTIONAL_AIR / weight.density)
    return place.gravity * place.lever * buoyancy * conventional


def force_of(load: Load, weights: Mapping[str, Weight], place: Place) -> float:
    """N. Raises ValueError for a weight that the set does not have."""
    return load.direction * sum(_pull(name, weights, place) for name in load.weights)


def _pull(name: str, weights: Mapping[str, Weight], place: Place) -> float:
    if name not in weights:
        raise ValueError(f"there is no weight {name!r} in the set; it has {', '.join(weights)}")
    return weights[name].mass * newtons_per_kilogram(weights[name], place)


def forces_of(loads: Sequence[Load], weights: Mapping[str, Weight], place: Place, correlation: float = 1.0) -> Forces:
    """Forces with their sources. `correlation` between the errors of any two weights: 1 when all were compared with one
    reference, whose error they share, so that those of a stack add up (EURAMET cg-18, 7.1.2).

    Raises ValueError for a weight that the set does not have, or a correlation outside 0 to 1.
    """
    if not 0.0 <= correlation <= 1.0:
        raise ValueError(f"correlation of the weights must be between 0 and 1, but is {correlation:g}")
    value = np.array([force_of(load, weights, place) for load in loads])
    names = list(weights)
    per_std = np.zeros((len(loads), len(names)))
    by_density = np.zeros(len(loads))
    by_air = np.zeros(len(loads))
    for k, load in enumerate(loads):
        for name in load.weights:
            weight, pull = weights[name], load.direction * _pull(name, weights, place)
            per_std[k, names.index(name)] = pull / weight.mass * weight.std
            by_air[k] -= pull / (weight.density - place.air_density)
            by_density[k] += pull * _of_density(weight, place) * weight.density_std
    shared = np.sqrt(correlation) * per_std.sum(axis=1, keepdims=True)
    found = (
        Source("mass of the weights", np.hstack([np.sqrt(1.0 - correlation) * per_std, shared])),
        Source("local gravity", (value * place.gravity_std / place.gravity)[:, None]),
        Source("density of the air", (by_air * place.air_density_std)[:, None]),
        Source("density of the weights", by_density[:, None]),
        Source("lever arm", (value * place.lever_std / place.lever)[:, None]),
    )
    return Forces(value, tuple(source for source in found if np.any(source.effect != 0.0)))


def _of_density(weight: Weight, place: Place) -> float:
    """Relative change of the force per kg/m^3 of density: none in air of 1.2 kg/m^3, which is why mass is stated so."""
    rho = weight.density
    return place.air_density / (rho * (rho - place.air_density)) - CONVENTIONAL_AIR / (rho * (rho - CONVENTIONAL_AIR))
