"""Motion of a body with linear drag under a constant and a sine force: the worked example of section 4.2.3.

    m x'' = f0 + delta_f sin(omega t) - k_l x'

The thesis prints for the velocity a last term ``sin(w t) - w tau (cos(w t) - 1)``. That does not satisfy the equation
above: the 1 must be ``exp(-t / tau)``, the part of the start that dies away. As printed, the velocity keeps an offset
``delta_f / k_l * w tau / (1 + w^2 tau^2)`` for ever (0.0637 m/s with the numbers of the example, 11.5 m after 180 s).
The printed position is the exact integral of the printed velocity, so the slip goes through. And the printed ``x0`` is
the velocity at the start; the position at the start is left out (it is 0 there). Here both are arguments.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class LinearDrag:
    """SI units; for a rotation read kg m^2, N m, rad and so on."""

    m: float
    """kg, inertia with added mass."""
    k_l: float
    """N s/m, linear drag, > 0."""
    f0: float
    """N, constant force."""
    delta_f: float
    """N, amplitude of the sine force."""
    omega: float
    """rad/s, > 0."""

    @property
    def tau(self) -> float:
        """s, time constant m / k_l."""
        return self.m / self.k_l


THESIS_EXAMPLE = LinearDrag(m=500.0, k_l=170.0, f0=35.0, delta_f=25.0, omega=0.1963)
"""The numbers of section 4.2.3 (units are not printed there: SI)."""


def linear_drag_response(t: Floats, body: LinearDrag, x0: float = 0.0, v0: float = 0.0) -> tuple[Floats, Floats]:
    """Position (n,) m and velocity (n,) m/s at times t (n,) s, from x0 (m) and v0 (m/s) at t = 0.

    >>> x, v = linear_drag_response(np.array([0.0, 1e4]), LinearDrag(2.0, 4.0, 8.0, 0.0, 1.0), x0=3.0, v0=1.0)
    >>> x[0].item(), v.round(9).tolist()
    (3.0, [1.0, 2.0])
    """
    tau, w = body.tau, body.omega
    wt, gone = w * tau, -np.expm1(-t / tau)
    steady, swing = body.f0 / body.k_l, body.delta_f / body.k_l / (1 + wt**2)
    v: Floats = v0 * (1 - gone) + steady * gone + swing * (np.sin(w * t) - wt * (np.cos(w * t) - 1 + gone))
    shift = (1 - np.cos(w * t)) / w - tau * np.sin(w * t) + wt * tau * gone
    x: Floats = x0 + tau * (v0 - steady) * gone + steady * t + swing * shift
    return x, v


def sine_derivative_bound(body: LinearDrag, order: int) -> float:
    """Largest |d^order x / dt^order| (m/s^order) once the start has died away, order >= 2.

    >>> round(sine_derivative_bound(THESIS_EXAMPLE, 2), 4)
    0.025
    """
    if order < 2:
        raise ValueError(f"sine_derivative_bound: order must be at least 2, got {order}")
    speed = body.delta_f / body.k_l / float(np.hypot(1.0, body.omega * body.tau))
    return float(speed * body.omega ** (order - 1))
