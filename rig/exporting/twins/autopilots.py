"""ArduSub and PX4: parameter files, and which firmware acts on them.

Sources: ArduPilot AP_Motors6DOF.cpp at 0fd5fbf2 (released: pulse = 1500 + 400 effort, nothing else),
AP_Motors_Thrust_Linearization.cpp at 04dc0b71 with pull requests 32409 (Sub reads MOT_THST_EXPO and MOT_SPIN_MIN) and
32577 (unequal directions), both open when they were read. PX4 src/lib/mixer_module/motor_params.yaml at 1cf10fee:
thrust = f x^2 + (1 - f) x of the most, one f for all motors.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rig.exporting.twins.curve import Curve, Floats
from rig.exporting.twins.forms import effort_law, fitted, points
from rig.exporting.twins.written import Asked, Carried, Loss, hashed, head, loss_of, put

STARTS = ((0.3, 0.02), (0.8, 0.1))


def expo(curve: Curve) -> tuple[float, float, float, float]:
    """MOT_THST_EXPO, MOT_SPIN_MIN, N ahead, N astern at full effort."""
    driver, thrust = points(curve)
    effort, ahead, astern = driver / curve.largest, float(thrust[-1]), float(-thrust[0])

    def law(p: Floats) -> Floats:
        return effort_law(effort, min(p[0], 1.0), min(p[1], 0.9), p[2], p[3])

    found = fitted(lambda p: law(np.array(p)), thrust, [(*start, ahead, astern) for start in STARTS])
    return min(found[0], 1.0), min(found[1], 0.9), found[2], found[3]


def ardusub_carried(asked: Asked) -> Carried:
    curve = asked.curve
    found = expo(curve)
    return Carried(lambda u: effort_law(u / curve.largest, *found))


def released(curve: Curve) -> Carried:
    """Released Sub takes the effort for the thrust: the best scale there is."""
    driver, thrust = points(curve)
    scale = float(driver @ thrust / (driver @ driver))
    return Carried(lambda u: scale * u)


def write_ardusub(asked: Asked, path: Path) -> None:
    e, start, ahead, astern = expo(asked.curve)
    told: Loss = loss_of(released(asked.curve), asked.curve)
    told_of = [
        "MOT_THST_EXPO and MOT_SPIN_MIN act in Sub from pull request 32409 on, unequal directions from 32577 on;",
        f"released firmware takes effort for thrust, whatever stands here: {told.rms:.3g} N rms, at worst"
        f" {told.worst:.3g} N",
        f"Full effort: {ahead:.6g} N ahead, {astern:.6g} N astern, at {asked.curve.largest:.6g} {asked.curve.unit}",
    ]
    astern_us, neutral, ahead_us = asked.pulse
    put(
        path,
        [
            *hashed([*head(asked, ardusub_carried(asked)), *told_of]),
            f"MOT_THST_EXPO,{e:.4f}",
            f"MOT_SPIN_MIN,{start:.4f}",
            "MOT_SPIN_MAX,1.0",
            *(f"SERVO1_{key},{us:.0f}" for key, us in (("MIN", astern_us), ("TRIM", neutral), ("MAX", ahead_us))),
        ],
    )


def factor(curve: Curve) -> tuple[float, float]:
    """THR_MDL_FAC, and N at full effort."""
    driver, thrust = points(curve)
    effort = driver / curve.largest
    most = float(np.max(np.abs(thrust)))

    def law(f: float, scale: float) -> Floats:
        return effort_law(effort, min(f, 1.0), 0.0, scale, scale)

    found = fitted(lambda p: law(p[0], p[1]), thrust, [(0.3, most), (0.9, most)])
    return min(found[0], 1.0), found[1]


def px4_carried(asked: Asked) -> Carried:
    curve = asked.curve
    f, most = factor(curve)
    return Carried(
        lambda u: effort_law(u / curve.largest, f, 0.0, most, most),
        lost=("dead band and unequal directions: one factor serves all motors, both ways",),
    )


def write_px4(asked: Asked, path: Path) -> None:
    """As QGroundControl reads it: vehicle, component, name, value, type (9: float)."""
    f, most = factor(asked.curve)
    told = [f"Full effort: {most:.6g} N at {asked.curve.largest:.6g} {asked.curve.unit}, in reverse the same"]
    rows = [("THR_MDL_FAC", f)]
    if asked.curve.lag:
        told.append("SIH_T_TAU is the lag of the simulation in hardware alone")
        rows.append(("SIH_T_TAU", asked.curve.lag))
    put(
        path,
        [
            *hashed([*head(asked, px4_carried(asked)), *told]),
            *(f"1\t1\t{name}\t{value:.6f}\t9" for name, value in rows),
        ],
    )
