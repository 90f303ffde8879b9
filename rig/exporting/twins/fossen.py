"""Fossen's simulators, MSS (MATLAB) and PythonVehicleSimulator: thrust by the square of the rate, each way its own.

Sources: cybergalactic/MSS at 736a3d12, CRAFT/USV/models/otter.m; PythonVehicleSimulator at c717e073, vehicles/otter.py:
k_pos and k_neg in N per (rad/s)^2, n_max and n_min in rad/s, T_n in s.
"""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np

from rig.exporting.twins.curve import Curve, Floats
from rig.exporting.twins.forms import each_way, points, rates_at, square
from rig.exporting.twins.written import Asked, Carried, hashed, head, put


def constants(curve: Curve) -> tuple[float, float]:
    """k_pos, k_neg. Raises TwinError where the twin does not know the rate."""
    driver, thrust = points(curve)
    return each_way(2 * pi * rates_at(curve, driver), thrust)


def carried(asked: Asked) -> Carried:
    curve = asked.curve
    k_pos, k_neg = constants(curve)

    def thrust(u: Floats) -> Floats:
        n = 2 * pi * rates_at(curve, u)
        out: Floats = np.where(n < 0, k_neg, k_pos) * square(n)
        return out

    return Carried(thrust, lag=True, lost=("the way from the input to the rate: these models are commanded in rad/s",))


def _rows(curve: Curve) -> list[tuple[str, float, str]]:
    k_pos, k_neg = constants(curve)
    n = 2 * pi * curve.rates
    return [
        ("k_pos", k_pos, "N/(rad/s)^2, ahead"),
        ("k_neg", k_neg, "N/(rad/s)^2, astern"),
        ("n_max", float(np.max(n)), "rad/s"),
        ("n_min", float(np.min(n)), "rad/s"),
        ("T_n", curve.lag, "s, first-order lag of the rate"),
    ]


def write_mss(asked: Asked, path: Path) -> None:
    lines = [f"{name} = {value:.9g};  % {unit}" for name, value, unit in _rows(asked.curve)]
    put(path, [*hashed(head(asked, carried(asked)), "%"), *lines])


def write_pvs(asked: Asked, path: Path) -> None:
    lines = [f"self.{name} = {value:.9g}  # {unit}" for name, value, unit in _rows(asked.curve)]
    put(path, [*hashed(head(asked, carried(asked))), *lines])
