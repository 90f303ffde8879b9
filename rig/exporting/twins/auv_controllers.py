"""ROS 2 `auv_controllers`: thrust to pulse by one polynomial.

Source: Robotic-Decision-Making-Lab/auv_controllers at 9ac9ebaa, thruster_controllers/src, parameters of
`polynomial_thrust_curve_controller`: coefficients of the pulse in us over the thrust in N, the lowest degree first.
Within min_thrust and max_thrust; no thrust is the neutral pulse.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.polynomial.polynomial import polyval

from rig.exporting.twins.curve import Floats
from rig.exporting.twins.forms import polynomial
from rig.exporting.twins.written import Asked, Carried, hashed, head, put

DEGREE = 5


def pulse(asked: Asked, driver: Floats) -> Floats:
    """us, straight from neutral to full each way."""
    astern, neutral, ahead = asked.pulse
    share = driver / asked.curve.largest
    out: Floats = neutral + np.where(share < 0, neutral - astern, ahead - neutral) * share
    return out


def driver(asked: Asked, us: Floats) -> Floats:
    """Of a pulse."""
    astern, neutral, ahead = asked.pulse
    out: Floats = asked.curve.largest * (us - neutral) / np.where(us < neutral, neutral - astern, ahead - neutral)
    return out


def coefficients(asked: Asked) -> list[float]:
    return polynomial(asked.curve, DEGREE, lambda u: pulse(asked, u))


def carried(asked: Asked) -> Carried:
    """Of each thrust that is asked for, what the pulse of the polynomial gives."""
    curve, shape = asked.curve, coefficients(asked)

    def given(u: Floats) -> Floats:
        wanted = curve.at(u)
        us = np.clip(np.asarray(polyval(wanted, shape)), asked.pulse[0], asked.pulse[2])
        return curve.at(driver(asked, np.where(wanted == 0.0, asked.pulse[1], us)))

    return Carried(given, lost=("a dead band and unequal directions, as far as one polynomial cannot follow them",))


def edges(asked: Asked) -> tuple[float, float]:
    """us, between which the twin gives no thrust."""
    still = np.abs(asked.curve.thrust) <= asked.curve.thrust.max() * 1e-6
    us = pulse(asked, asked.curve.driver[still])
    neutral = asked.pulse[1]
    return (float(us.min()), float(us.max())) if us.size else (neutral, neutral)


def write(asked: Asked, path: Path) -> None:
    curve, (low, high) = asked.curve, edges(asked)
    shape = ", ".join(f"{value:.9e}" for value in coefficients(asked))
    put(
        path,
        [
            *hashed(head(asked, carried(asked))),
            *hashed([f"Pulses: {asked.pulse[0]:g} to {asked.pulse[2]:g} us are {curve.driver[0]:.6g} to"
                     f" {curve.driver[-1]:.6g} {curve.unit} (--pulse)"]),
            f"{asked.name}_controller:",
            "  ros__parameters:",
            f"    thruster: {asked.name}",
            f"    thrust_curve_coefficients: [{shape}]",
            f"    min_thrust: {float(np.min(curve.thrust))!r}",
            f"    max_thrust: {float(np.max(curve.thrust))!r}",
            f"    min_deadband_pwm: {round(low)}",
            f"    max_deadband_pwm: {round(high)}",
            f"    neutral_pwm: {round(asked.pulse[1])}",
        ],
    )  # fmt: skip
