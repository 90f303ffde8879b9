"""Vehicles in which one effect is concealed, their recordings, and what an analyst would know of them beforehand.

Made by sim_devices.vehicle, which knows nothing of the identification. `PLAIN` is the strength of each effect that
anybody would see.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import cos, pi, radians, sin

import numpy as np

from identification.mismatch.vehicle.setup import ANY_AXIS, Stated, VehicleSetup
from identification.recording import Channel, Recording, Step
from identification.vehicle.efficiency import Installation, Interaction, Thruster
from sim_devices.vehicle import Hull, Trial, romeo, run_trials
from sim_devices.vehicle.body import Body
from sim_devices.vehicle.campaign import ALL, DIVE, FRONT, REAR, scaled, sine
from sim_devices.vehicle.trials import Hold, Record

QUADRATIC = {"surge": 420.0, "heave": 700.0, "sway": 600.0, "yaw": 90.0}
MASS = {"surge": 800.0, "heave": 1100.0, "sway": 1000.0, "yaw": 160.0}
LEVELS = (3.0, 6.0, 10.0, 15.0, 20.0)
"""V."""


def levels_of(name: str, axis: str, group: Mapping[str, float], degrees: float = 0.0, ballast: float = 0.0) -> Trial:
    """Each level ahead and back, from rest."""
    parts = [Hold(scaled(group, sign * level), 16.0) for level in LEVELS for sign in (1.0, -1.0)]
    return Trial(name, axis, parts, degrees * pi / 180, ballast)


def surge_trials() -> list[Trial]:
    """Front pair, rear pair and all four at three headings, and a sine."""
    groups = (("front", FRONT, 0.0), ("rear", REAR, 90.0), ("all", ALL, 200.0))
    return [*(levels_of(name, "surge", group, heading) for name, group, heading in groups), sine("surge", ALL, 16.0)]


def heave_trials() -> list[Trial]:
    """Down and up, and a sine."""
    return [levels_of("dive", "heave", DIVE), levels_of("dive-again", "heave", DIVE), sine("heave", DIVE, 10.0)]


@dataclass(frozen=True)
class Case:
    """One vehicle: the truth, and what is stated of it."""

    effect: str
    """Concealed; empty: none."""
    axis: str
    hull: Hull
    stated_mass: float | None


def clean(rng: np.random.Generator) -> Hull:
    """Quadratic drag and thrusters, no more; sizes drawn at random."""

    def about(value: float) -> float:
        return float(value * np.exp(rng.uniform(-0.4, 0.4)))

    axes = {axis: Body(about(MASS[axis]), 0.0, about(QUADRATIC[axis])) for axis in MASS}
    return romeo({f"T{i}": about(0.4) for i in range(1, 9)}, axes, 1.0, 1.0)


Conceal = Callable[[Hull, str, float], Hull]


def _body(hull: Hull, axis: str, **changed: float) -> Hull:
    return replace(hull, axes={**hull.axes, axis: replace(hull.axes[axis], **changed)})


PLAIN: Mapping[str, tuple[Conceal, float]] = {
    "installation_efficiency": (lambda h, _, s: replace(h, eta_hull=1 - 0.25 * s), 1.0),
    "installation_efficiency (pair)": (lambda h, _, s: replace(h, eta_pair=1 - 0.2 * s), 1.0),
    "linear_drag": (lambda h, a, s: _body(h, a, linear=0.15 * s * h.axes[a].quadratic), 1.0),
    "quadratic_drag": (lambda h, a, s: _body(h, a, astern=1 + 0.4 * s), 1.0),
    "current": (lambda h, _, s: replace(h, current=(0.1 * s * cos(1.0), 0.1 * s * sin(1.0))), 1.0),
    "buoyancy_offset": (lambda h, _, s: replace(h, buoyancy=-20.0 * s), 1.0),
    "tether_drag": (lambda h, a, s: replace(h, tether=0.01 * s * h.axes[a].quadratic), 1.0),
    "added_mass": (lambda h, a, s: _body(h, a, inertia=(1 + 0.3 * s) * h.axes[a].inertia), 1.0),
    "dead_band": (lambda h, _, s: replace(h, dead_band=0.8 * s), 1.0),
    "motor_lag": (lambda h, _, s: replace(h, motor_lag=0.8 * s), 1.0),
}
HEAVE = ("buoyancy_offset",)
"""Effects that only act there."""


def case(rng: np.random.Generator, name: str, strength: float = 1.0) -> Case:
    """A vehicle with one effect of PLAIN, or with none."""
    hull = clean(rng)
    axis = "heave" if name in HEAVE else "surge"
    mass = hull.axes[axis].inertia
    changed = hull if not name else PLAIN[name][0](hull, axis, strength)
    known = mass if name == "added_mass" or (not name and rng.random() < 0.5) else None
    return Case(name.split(" ", 1)[0], axis, changed, known)


def recordings(one: Case, rng: np.random.Generator, trials: Sequence[Trial] | None = None) -> list[Recording]:
    wanted = trials if trials is not None else surge_trials() if one.axis == "surge" else heave_trials()
    return [_recording(record) for record in run_trials(one.hull, wanted, rng)]


def _recording(record: Record) -> Recording:
    channels = tuple(
        Channel(c.name, c.stream, c.quantity, c.unit, c.time, c.value, c.noise_std, thruster=c.thruster, axis=c.axis)
        for c in record.channels
    )
    steps = tuple(Step(s.index, s.phase, s.command_voltage, s.t_start, s.t_end) for s in record.steps)
    return Recording(record.name, record.vehicle, channels, steps=steps, kind="vehicle")


def setup(one: Case, rng: np.random.Generator) -> VehicleSetup:
    """The drawings, the tunnel's fits of the thrusters (0.4 % each), and the mass where it is stated."""
    c = cos(radians(45))
    places = {"T1": (c, 1.0), "T2": (c, -1.0), "T3": (c, -1.0), "T4": (c, 1.0)}
    arms = {name: {"surge": c, "sway": side * c} for name, (_, side) in places.items()}
    arms |= {f"T{i}": {"heave": 1.0} for i in (5, 6, 7, 8)}
    stated = {name: one.hull.thrusters[name].C * (1 + 0.004 * rng.standard_normal()) for name in arms}
    thrusters = tuple(Thruster(name, np.array([stated[name]]), arms[name]) for name in arms)
    values = np.array([stated[name] for name in arms])
    sides = {"T1": "T3", "T3": "T1", "T2": "T4", "T4": "T2"}
    interactions = (
        Interaction("eta_hull", ("T1", "T2"), -1),
        Interaction("eta_hull", ("T3", "T4"), 1),
        Interaction("eta_pair", tuple(sides), 0, sides),
    )
    installation = Installation(thrusters, np.diag((0.004 * values) ** 2), interactions)
    ballast = {"dive": "one", "dive-again": "one", "heave-sine": "one"} if one.axis == "heave" else {}
    mass = {} if one.stated_mass is None else {ANY_AXIS: Stated(one.stated_mass, 0.01 * one.stated_mass)}
    return VehicleSetup(installation, mass, ballast)
