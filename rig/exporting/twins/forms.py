"""The formulas that consumers have, fitted to the twin's curve by least squares: for where no table is accepted."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import least_squares

from rig.exporting.twins.curve import Curve, Floats

FINE = 401
"""Points of the curve that a formula is fitted to."""


def points(curve: Curve) -> tuple[Floats, Floats]:
    """(FINE,) drivers and N."""
    driver = np.linspace(curve.driver[0], curve.driver[-1], FINE)
    return driver, curve.at(driver)


def rates_at(curve: Curve, driver: Floats) -> Floats:
    """rev/s. Raises TwinError where the twin does not know them."""
    found: Floats = np.interp(driver, curve.driver, curve.rates)
    return found


def square(x: Floats) -> Floats:
    return x * np.abs(x)


def one_way(x: Floats, thrust: Floats) -> float:
    """C of C x|x|."""
    shape = square(x)
    return float(shape @ thrust / (shape @ shape))


def each_way(x: Floats, thrust: Floats) -> tuple[float, float]:
    """C of x|x| for x > 0, and for x < 0."""
    return one_way(x[x > 0], thrust[x > 0]), one_way(x[x < 0], thrust[x < 0])


def fitted(law: Callable[[Sequence[float]], Floats], wanted: Floats, starts: Sequence[Sequence[float]]) -> list[float]:
    """Parameters of a law, none negative: the best of the fits from `starts`."""

    def missed(p: Floats) -> Floats:
        return law(list(p)) - wanted

    found = [least_squares(missed, start, bounds=(0.0, np.inf)) for start in starts]
    best = min(found, key=lambda each: float(each.cost))
    return [float(value) for value in best.x]


def effort_law(effort: Floats, expo: float, start: float, ahead: float, astern: float) -> Floats:
    """N: nothing up to `start`, then the share (1-e)u + e u^2 of the most, each way its own."""
    u = np.clip((np.abs(effort) - start) / (1.0 - start), 0.0, None)
    out: Floats = np.where(effort < 0, -astern, ahead) * ((1.0 - expo) * u + expo * u * u)
    return out


def polynomial(curve: Curve, degree: int, pulse: Callable[[Floats], Floats]) -> list[float]:
    """Coefficients, the lowest first, of the pulse in us that gives a thrust in N; `pulse` of a driver.

    What counts is the error of the thrust: a pulse is weighed by what a little of it changes there."""
    driver, thrust = points(curve)
    turning = np.abs(thrust) > 0
    scale = float(np.max(np.abs(thrust)))
    slope = np.abs(np.gradient(thrust, driver))[turning]
    shares = np.polynomial.polynomial.polyfit(thrust[turning] / scale, pulse(driver[turning]), degree, w=slope)
    return [float(c / scale**i) for i, c in enumerate(shares)]
