"""What an experiment on a thruster is designed for: the model's regressor, the noise of a hold, what a run will tell.

    tau = C V|V| + tare                              (eq. 4.14), with C+ and C- for the directions if asked for
        + k V                                        with a linear term
    V|V| -> sgn(V) max(|V| - d, 0)^2                 with a dead band d; linearised about its expected value

A hold of T s after settling gives its mean thrust with the variance (white^2 + (proportional tau)^2) / T + floor^2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from identification.estimation.regression import Deficiency, least_squares
from identification.estimation.tails import normal_quantile
from identification.recording import Floats

LEVEL, POWER = 0.05, 0.8
"""A deviation counts as noticed when a two-sided test at this level finds it with this probability."""


@dataclass(frozen=True, slots=True)
class Terms:
    """The model and what is expected of it."""

    C: float = 1.0
    """N/V^2"""
    two_sided: bool = False
    linear: bool = False
    dead_band: float | None = None
    """V, expected half width; None: not in the model."""

    @property
    def names(self) -> tuple[str, ...]:
        """The tare is the last one."""
        coefficients = ("C_plus", "C_minus") if self.two_sided else ("C",)
        return (
            *coefficients,
            *(("k",) if self.linear else ()),
            *(("dead_band",) if self.dead_band is not None else ()),
            "tare",
        )

    @property
    def units(self) -> tuple[str, ...]:
        known = {"k": "N/V", "dead_band": "V", "tare": "N"}
        return tuple(known.get(name, "N/V^2") for name in self.names)

    def thrust(self, V: Floats) -> Floats:
        """N expected at V (n,), without linear term and tare."""
        return self.C * self._square(V)

    def _square(self, V: Floats) -> Floats:
        out: Floats = np.sign(V) * np.maximum(np.abs(V) - (self.dead_band or 0.0), 0.0) ** 2
        return out

    def rows(self, V: Floats) -> Floats:
        """Regressor (n, p) at V (n,).

        >>> Terms(two_sided=True).rows(np.array([2.0, -3.0])).tolist()
        [[4.0, 0.0, 1.0], [0.0, -9.0, 1.0]]
        """
        square = self._square(V)
        columns = [np.maximum(square, 0.0), np.minimum(square, 0.0)] if self.two_sided else [square]
        if self.linear:
            columns.append(V)
        if self.dead_band is not None:
            columns.append(-2 * self.C * np.sign(V) * np.maximum(np.abs(V) - self.dead_band, 0.0))
        return np.column_stack([*columns, np.ones(V.size)])

    def size(self, V_max: float) -> Floats:
        """(p,) what each parameter must be to make all of the thrust at V_max; inf for the tare, which is no aim."""
        full = float(self.thrust(np.array([V_max]))[0])
        known = {"k": full / V_max, "dead_band": V_max, "tare": float("inf")}
        return np.array([known.get(name, self.C) for name in self.names])


@dataclass(frozen=True, slots=True)
class Noise:
    """Of the mean of a hold."""

    white: float
    """N s^(1/2): standard error of one second at rest."""
    proportional: float = 0.0
    """s^(1/2): the part that grows with the thrust."""
    floor: float = 0.0
    """N, repeatability of a hold, however long."""

    def std(self, thrust: Floats, seconds: Floats) -> Floats:
        """N, standard error of means at `thrust` N over `seconds` s.

        >>> Noise(0.2, 0.0, 0.3).std(np.array([5.0]), np.array([0.25])).tolist()
        [0.5]
        """
        out: Floats = np.sqrt((self.white**2 + (self.proportional * thrust) ** 2) / seconds + self.floor**2)
        return out


def noise_of(std_error: Floats, seconds: Floats, thrust: Floats, floor: float) -> Noise:
    """From the points (n,) of an earlier run; `floor` is the excess its fit found. Relative least squares on variances.

    >>> true = Noise(0.1, 0.01)
    >>> thrust = np.array([0.0, 10.0, 40.0, 160.0])
    >>> found = noise_of(true.std(thrust, np.full(4, 2.0)), np.full(4, 2.0), thrust, 0.0)
    >>> round(found.white, 6), round(found.proportional, 6)
    (0.1, 0.01)
    """
    per_second = std_error**2 * seconds
    columns = np.column_stack([np.ones(thrust.size), thrust**2]) / per_second[:, None]
    scale = np.maximum(np.abs(columns).max(axis=0), 1e-300)
    found, _ = nnls(columns / scale, np.ones(thrust.size))
    white, proportional = np.sqrt(found / scale)
    return Noise(float(white) or float(np.sqrt(per_second.min())), float(proportional), floor)


@dataclass(frozen=True, eq=False)
class Means:
    """What a run measures: n means, tares among them, in the order of time."""

    voltage: Floats
    """V"""
    seconds: Floats
    """s of each mean, settling left out."""
    at: Floats
    """s from the start, middle of each mean."""


@dataclass(frozen=True, eq=False)
class Promise:
    """What the fit of a run will know."""

    names: tuple[str, ...]
    cov: Floats
    """(p, p)"""
    rows: Floats
    """(n, p)"""
    std_error: Floats
    """(n,) N, of each mean."""

    @property
    def std(self) -> Floats:
        out: Floats = np.sqrt(np.diag(self.cov))
        return out


def promise(means: Means, terms: Terms, noise: Noise) -> Promise | Deficiency:
    """Covariance by eq. 4.9 before anything is measured; a Deficiency when the run cannot tell its parameters apart.

    >>> run = Means(np.array([0.0, 10.0]), np.array([4.0, 4.0]), np.array([2.0, 8.0]))
    >>> found = promise(run, Terms(), Noise(0.2))
    >>> isinstance(found, Promise) and found.std.round(6).tolist()
    [0.001414, 0.1]
    """
    error = noise.std(terms.thrust(means.voltage), means.seconds)
    rows = terms.rows(means.voltage)
    fit = least_squares(rows, np.zeros(error.size), terms.names, error)
    return Promise(terms.names, fit.cov, rows, error) if fit.deficiency is None else fit.deficiency


def noticed(found: Promise, levels: Floats, voltage: Floats) -> Floats:
    """N (k,): deviation of the truth from the model at one of `levels` (k,) that the run would notice (LEVEL, POWER).

    The means at `voltage` (n,) equal to the level shift together; the fit takes up what it can, the chi-square of the
    rest with one degree of freedom shows it. inf for a level that the model bends itself to.

    >>> run = Means(np.array([0.0, 5.0, 10.0]), np.full(3, 4.0), np.arange(3.0))
    >>> found = promise(run, Terms(), Noise(0.2))
    >>> noticed(found, np.array([5.0]), run.voltage).round(2).tolist() if isinstance(found, Promise) else None
    [0.36]
    """
    H = found.rows / found.std_error[:, None]
    hat = H @ found.cov @ H.T
    out = np.full(levels.size, np.inf)
    for i, level in enumerate(levels):
        shift = (np.abs(voltage - level) < 1e-9) / found.std_error
        left = float(shift @ shift - shift @ hat @ shift)
        if left > 1e-9 * float(shift @ shift):
            out[i] = (normal_quantile(1 - LEVEL / 2) + normal_quantile(POWER)) / np.sqrt(left)
    return out
