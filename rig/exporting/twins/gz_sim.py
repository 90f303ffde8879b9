"""Gazebo's thruster system, which VRX uses as well: commanded in newtons, or in rad/s by one coefficient.

Source: gazebosim/gz-sim, src/systems/thruster/Thruster.hh and .cc at 93bbf3ed: T = k rho D^4 w|w|, w in rad/s; the
limits are of the command; `deadband` is in N. The force follows at once; PID gains move the drawn propeller alone.
"""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np

from rig.exporting.twins.curve import Floats
from rig.exporting.twins.forms import one_way, points, rates_at, square
from rig.exporting.twins.written import Asked, Carried, head, put, xml_comment

ONE_COEFFICIENT = "unequal directions: one coefficient serves both"
ASSUMED = 0.1
"""m: where the diameter is not known; k D^4 acts alone."""


def in_newtons(asked: Asked) -> Carried:
    """The command is the force itself."""
    return Carried(
        asked.curve.at,
        lost=(
            "the curve from the input to N, which has to stand in the node before: --to uuv-manager, auv-polynomial",
        ),
    )


def by_rate(asked: Asked) -> Carried:
    curve, k = asked.curve, coefficient(asked)
    return Carried(lambda u: k * square(2 * pi * rates_at(curve, u)), lost=(ONE_COEFFICIENT,))


def coefficient(asked: Asked) -> float:
    """N per (rad/s)^2. Raises TwinError where the twin does not know the rate."""
    driver, thrust = points(asked.curve)
    return one_way(2 * pi * rates_at(asked.curve, driver), thrust)


def write(asked: Asked, path: Path) -> None:
    thrust = asked.curve.thrust
    inside = [
        "  <use_angvel_cmd>false</use_angvel_cmd>",
        *(_propeller(asked) if asked.curve.rate is not None else []),
        *_limits(float(np.min(thrust)), float(np.max(thrust))),
    ]
    _put(asked, path, in_newtons(asked), inside)


def write_by_rate(asked: Asked, path: Path) -> None:
    rates: Floats = 2 * pi * asked.curve.rates
    inside = [
        "  <use_angvel_cmd>true</use_angvel_cmd>",
        *_propeller(asked),
        *_limits(float(np.min(rates)), float(np.max(rates))),
    ]
    _put(asked, path, by_rate(asked), inside)


def _put(asked: Asked, path: Path, carried: Carried, inside: list[str]) -> None:
    assumed = f"The diameter is not known here (--diameter): {ASSUMED:g} m is written; the coefficient suits it"
    told = [] if asked.diameter is not None or asked.curve.rate is None else [assumed]
    put(
        path,
        [
            *xml_comment([*head(asked, carried), *told]),
            '<plugin filename="gz-sim-thruster-system" name="gz::sim::systems::Thruster">',
            "  <namespace>rov</namespace>",
            f"  <joint_name>{asked.name}_propeller_joint</joint_name>",
            *inside,
            "</plugin>",
        ],
    )


def _propeller(asked: Asked) -> list[str]:
    diameter = asked.diameter or ASSUMED
    return [
        f"  <fluid_density>{asked.density:.9g}</fluid_density>",
        f"  <propeller_diameter>{diameter:.9g}</propeller_diameter>",
        f"  <thrust_coefficient>{coefficient(asked) / (asked.density * diameter**4):.9g}</thrust_coefficient>",
        "  <velocity_control>true</velocity_control>",
    ]


def _limits(low: float, high: float) -> list[str]:
    """Of the command, in its unit."""
    return [f"  <max_thrust_cmd>{high:.9g}</max_thrust_cmd>", f"  <min_thrust_cmd>{low:.9g}</min_thrust_cmd>"]
