"""What a cell reads of a force, and back: reading = zero + gain F + even F^2 + odd F|F| + cubic F^3. Plain numbers.

Beyond the calibrated range it goes on straight. The inverse is Newton's, from the straight line; the covariance is that
of the terms without the zero, which every run's own tare replaces.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, sqrt
from typing import Any

import numpy as np

from identification.recording import Floats

TERMS = ("gain", "even", "odd", "cubic")
"""N/N, 1/N, 1/N, 1/N^2."""
NEWTON_STEPS = 12
LEAST_SLOPE = 0.2
"""Of a curve that can be read back: a cell whose slope falls to a fifth within its range is broken."""


@dataclass(frozen=True)
class Curve:
    """A calibrated cell."""

    zero: float
    """N, reading without a load."""
    terms: tuple[float, float, float, float]
    """Of TERMS."""
    covariance: tuple[tuple[float, ...], ...]
    """(4, 4) of TERMS; zero where a term is left out."""
    low: float
    high: float
    """N, calibrated range of force."""
    dof: float
    """Effective degrees of freedom of the gain (Welch-Satterthwaite); infinite where the scatter is no part of it."""
    lag: float = 0.0
    """N, half the width of the hysteresis loop in its middle."""
    remanence: float = 0.0
    """N, half of what the zero after a load forward differs from that after one backward."""
    creep: float = 0.0
    """Relative, the most by which a long or a short hold reads otherwise than one of the calibration."""

    def __post_init__(self) -> None:
        numbers = (self.zero, *self.terms, self.low, self.high, self.lag, self.remanence, self.creep)
        cov = np.array(self.covariance, dtype=float)
        if cov.shape != (4, 4) or not (np.all(np.isfinite(cov)) and all(map(isfinite, numbers))):
            raise ValueError("a calibration's curve needs four terms, a covariance of 4 by 4, and finite numbers")
        if not np.allclose(cov, cov.T, rtol=1e-6, atol=1e-18) or np.any(np.diag(cov) < 0.0):
            raise ValueError("the covariance of a calibration's curve must be symmetric, with variances of at least 0")
        if not self.low <= 0.0 <= self.high or self.low == self.high:
            raise ValueError(f"the range of a calibration must hold 0 N, but is {self.low:g} to {self.high:g} N")
        if not self.dof > 0.0:
            raise ValueError(f"degrees of freedom must be above 0, but are {self.dof:g}")
        if min(self.slope(force) for force in np.linspace(self.low, self.high, 65)) < LEAST_SLOPE:
            raise ValueError("the reading does not rise with the force in all of the range: no force can be read back")

    def reading(self, force: float) -> float:
        """N that the cell reads."""
        held = min(max(force, self.low), self.high)
        gain, even, odd, cubic = self.terms
        inside = held * (gain + even * held + odd * abs(held) + cubic * held * held)
        return self.zero + inside + (force - held) * self.slope(held)

    def slope(self, force: float) -> float:
        """N/N"""
        held = min(max(force, self.low), self.high)
        gain, even, odd, cubic = self.terms
        return gain + 2.0 * even * held + 2.0 * odd * abs(held) + 3.0 * cubic * held * held

    def force(self, reading: float) -> float:
        """N that made the reading; NaN of NaN."""
        if not isfinite(reading):
            return reading
        found = (reading - self.zero) / self.terms[0]
        for _ in range(NEWTON_STEPS):
            step = (self.reading(found) - reading) / self.slope(found)
            found -= step
            if abs(step) <= 1e-12 * max(abs(found), 1.0):
                break
        return found

    def effects(self, force: Floats) -> Floats:
        """(n, q) N: columns whose outer products, summed, are the covariance of forces (n,) read with this curve.

        The terms by their covariance; hysteresis and creep as what is not known of a run, the same for all of it: one
        branch of the loop or the other, two values whose standard deviation is the half of what is between them, and a
        creep anywhere within its width with the same probability.
        """
        held = np.clip(force, self.low, self.high)
        slope = np.array([self.slope(each) for each in held])
        columns = np.column_stack([force, held**2, held * np.abs(held), held**3]) / slope[:, None]
        values, vectors = np.linalg.eigh(np.array(self.covariance))
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        share = np.abs(held) / np.where(held < 0.0, -self.low or np.inf, self.high or np.inf)
        lag = self.lag * 4.0 * share * (1.0 - share) * np.sign(held)
        remanence = self.remanence * np.sign(held)
        creep = self.creep / sqrt(3.0) * force
        out: Floats = np.column_stack([columns @ root, lag, remanence, creep])
        return out

    @property
    def gain_std(self) -> float:
        """Relative standard uncertainty of forces over the range, by the largest of them: what one number can say."""
        ends = [end for end in (self.low, self.high) if end != 0.0]
        effect = self.effects(np.array(ends))
        return float(np.max(np.linalg.norm(effect, axis=1) / np.abs(ends)))

    def as_json(self) -> dict[str, Any]:
        """What a recording carries."""
        return {
            "zero": self.zero,
            "terms": dict(zip(TERMS, self.terms, strict=True)),
            "covariance": [list(row) for row in self.covariance],
            "range": [self.low, self.high],
            "degrees_of_freedom": self.dof if isfinite(self.dof) else None,
            "lag": self.lag,
            "remanence": self.remanence,
            "creep": self.creep,
        }


def curve_of(facts: object) -> Curve:
    """From `Curve.as_json`. Raises ValueError that says what is missing or wrong."""
    if not isinstance(facts, Mapping):
        raise ValueError(f"a calibration's curve must be a table, but is {facts!r}")
    try:
        low, high = facts["range"]
        dof = facts["degrees_of_freedom"]
        gain, even, odd, cubic = (float(facts["terms"][name]) for name in TERMS)
        return Curve(
            float(facts["zero"]),
            (gain, even, odd, cubic),
            tuple(tuple(float(each) for each in row) for row in facts["covariance"]),
            float(low),
            float(high),
            float("inf") if dof is None else float(dof),
            float(facts.get("lag", 0.0)),
            float(facts.get("remanence", 0.0)),
            float(facts.get("creep", 0.0)),
        )
    except KeyError as error:
        raise ValueError(f"a calibration's curve lacks {error}") from None
    except TypeError as error:
        raise ValueError(f"a calibration's curve holds something else than numbers: {error}") from None
