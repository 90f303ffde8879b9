"""A vehicle like ROMEO (thesis section 4.2): eight thrusters, four of them in the horizontal plane as in fig. 4.3."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, radians, sin

from sim_devices.vehicle.body import Body, Hull, Mounted

ANGLE = radians(45.0)
"""Of the horizontal thrusters to the surge axis: an assumption, fig. 4.3 is a sketch."""
LEVER = 0.6
"""m, of each horizontal thruster about the vertical axis; the vehicle is 1.3 m long and 0.9 m wide."""

HORIZONTAL = {"T1": "front port", "T2": "front starboard", "T3": "rear port", "T4": "rear starboard"}
VERTICAL = ("T5", "T6", "T7", "T8")
# An X: at positive voltage all push ahead; front port and rear starboard push to starboard and turn to starboard
# (front port) or to port (rear starboard); the other diagonal does the opposite.
SWAY = {"T1": 1.0, "T2": -1.0, "T3": -1.0, "T4": 1.0}
YAW = {"T1": 1.0, "T2": -1.0, "T3": 1.0, "T4": -1.0}
PARTNER = {"T1": "T3", "T3": "T1", "T2": "T4", "T4": "T2"}
# Front thrusters wash the hull when they push backwards, rear ones when they push ahead (section 4.2.1).
HULL_SIDE = {"T1": -1, "T2": -1, "T3": 1, "T4": 1}

BODIES = {
    # 450 kg in air; added mass and drag of an open frame of 0.9 x 1.0 x 1.3 m, in round figures
    "surge": Body(inertia=800.0, linear=60.0, quadratic=420.0),
    "sway": Body(inertia=1000.0, linear=90.0, quadratic=600.0),
    "heave": Body(inertia=1100.0, linear=120.0, quadratic=700.0),
    "yaw": Body(inertia=160.0, linear=40.0, quadratic=90.0),
}


def romeo(
    C: Mapping[str, float] | None = None,
    axes: Mapping[str, Body] | None = None,
    eta_hull: float = 0.7,
    eta_pair: float = 0.85,
    current: tuple[float, float] = (0.0, 0.0),
    wander: float = 0.0,
) -> Hull:
    """The vehicle; `C` (N/V^2) of T1..T8, 0.4 where not given."""
    given = dict(C or {})
    arms = {t: {"surge": cos(ANGLE), "sway": SWAY[t] * sin(ANGLE), "yaw": YAW[t] * LEVER} for t in HORIZONTAL}
    thrusters = {t: Mounted(given.get(t, 0.4), arms[t], HULL_SIDE[t], PARTNER[t]) for t in HORIZONTAL}
    thrusters |= {t: Mounted(given.get(t, 0.4), {"heave": 1.0}) for t in VERTICAL}
    return Hull("ROMEO-like", dict(axes or BODIES), thrusters, eta_hull, eta_pair, current, wander=wander)
