"""The trials of a whole campaign in the water: what section 4.2 asks for, for each axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import pi

from sim_devices.vehicle.trials import Hold, Sine, Trial

LEVELS = (8.0, 12.0, 16.0, 20.0)
"""V."""
RUN_UP = 40.0
"""s: ten time constants of the slowest vehicle at the lowest level."""
LENGTH = 60.0
"""s at constant velocity."""
FRONT = {"T1": 1.0, "T2": 1.0}
REAR = {"T3": 1.0, "T4": 1.0}
ALL = {"T1": 1.0, "T2": 1.0, "T3": 1.0, "T4": 1.0}
SIDEWAYS = {"T1": 1.0, "T2": -1.0, "T3": -1.0, "T4": 1.0}
TURN_FRONT = {"T1": 1.0, "T2": -1.0}
TURN = {"T1": 1.0, "T2": -1.0, "T3": 1.0, "T4": -1.0}
DIVE = {"T5": 1.0, "T6": 1.0, "T7": 1.0, "T8": 1.0}
BALLAST = (-40.0, -15.0, 2.0, 20.0, 45.0)
"""N: two light, one nearly neutral, two heavy, as the five experiments of section 4.2.4."""


def scaled(group: Mapping[str, float], volts: float) -> dict[str, float]:
    """The volts of each thruster of a group whose shares are these."""
    return {name: share * volts for name, share in group.items()}


def there_and_back(
    name: str, axis: str, group: Mapping[str, float], levels: Sequence[float], heading: float = 0.0
) -> Trial:
    """Each level forwards, then backwards."""
    parts = [Hold(scaled(group, sign * level), LENGTH, RUN_UP) for level in levels for sign in (1.0, -1.0)]
    return Trial(name, axis, parts, heading)


def surge_steady() -> list[Trial]:
    """Front pair, rear pair and all four; two headings, so that a current shows."""
    groups = {"front": FRONT, "rear": REAR, "all": ALL}
    return [
        there_and_back(f"surge-{name}-{heading}", "surge", group, LEVELS, heading * pi / 180)
        for name, group in groups.items()
        for heading in (0, 90)
    ]


def sway_steady() -> list[Trial]:
    """Steady trials of sway, at two headings."""
    return [there_and_back(f"sway-{h}", "sway", SIDEWAYS, LEVELS, h * pi / 180) for h in (0, 90)]


def yaw_steady() -> list[Trial]:
    """Steady trials of yaw, by the front pair and by all four."""
    return [there_and_back(f"yaw-{n}", "yaw", g, LEVELS) for n, g in (("front", TURN_FRONT), ("all", TURN))]


def heave_steady(ballast: Sequence[float] = BALLAST) -> list[Trial]:
    """Down and up with five weights."""
    down_up = [Hold(scaled(DIVE, sign * level), 30.0, RUN_UP) for level in (6.0, 9.0, 12.0) for sign in (1.0, -1.0)]
    return [Trial(f"heave-{i + 1}", "heave", down_up, ballast=weight) for i, weight in enumerate(ballast)]


def sine(axis: str, group: Mapping[str, float], volts: float, name: str = "", ballast: float = 0.0) -> Trial:
    """180 s of a sine force about an offset, no reversal, as the example of section 4.2.3 (period 32 s)."""
    part = Sine(scaled(group, volts), offset=0.58, amplitude=0.42, period=2 * pi / 0.1963, length=180.0)
    return Trial(name or f"{axis}-sine", axis, [part], ballast=ballast)


SINES = {"surge": (FRONT, 20.0), "sway": (SIDEWAYS, 18.0), "heave": (DIVE, 12.0), "yaw": (TURN, 14.0)}


def sines(axis: str) -> list[Trial]:
    """Two sine trials of an axis, forwards and backwards; heave with the nearly neutral ballast."""
    group, volts = SINES[axis]
    weight = BALLAST[2] if axis == "heave" else 0.0
    return [sine(axis, group, sign * volts, f"{axis}-sine-{i + 1}", weight) for i, sign in enumerate((1.0, -1.0))]
