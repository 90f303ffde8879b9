"""Recordings of the simulated vehicle, vehicles drawn at random, what the tunnel said of their thrusters."""

from dataclasses import dataclass, field, replace
from math import cos, radians, sin
from time import process_time

import numpy as np

from identification.comparators import by_annealing, by_kalman
from identification.recording import Channel, Recording, Step
from identification.vehicle.campaign import CampaignFacts, identify_vehicle
from identification.vehicle.efficiency import Installation, Interaction, Thruster
from identification.vehicle.inertia import by_derivative, output_error
from identification.vehicle.steady_drag import identify_drag
from identification.vehicle.trials import trial
from sim_devices.vehicle import romeo, run_trials
from sim_devices.vehicle.body import Body
from sim_devices.vehicle.campaign import heave_steady, sines, surge_steady, sway_steady, yaw_steady
from sim_devices.vehicle.romeo import BODIES

GAIN_STD = 0.005
OWN_STD = 0.004
DRAWN = 10
AXES = ("surge", "sway", "heave", "yaw")
TRIALS = {"surge": surge_steady, "sway": sway_steady, "heave": heave_steady, "yaw": yaw_steady}


def recording_of(record) -> Recording:
    channels = tuple(
        Channel(c.name, c.stream, c.quantity, c.unit, c.time, c.value, c.noise_std, thruster=c.thruster, axis=c.axis)
        for c in record.channels
    )
    steps = tuple(Step(s.index, s.phase, s.command_voltage, s.t_start, s.t_end) for s in record.steps)
    return Recording(record.name, record.vehicle, channels, steps=steps, kind="vehicle")


def recordings_of(hull, trials, rng):
    return [recording_of(record) for record in run_trials(hull, trials, rng)]


def installation(coefficients, own=OWN_STD, gain=GAIN_STD) -> Installation:
    """The same lay-out written down a second time, as an analyst would from drawings."""
    c, lever = cos(radians(45)), 0.6
    arms = {
        "T1": {"surge": c, "sway": c, "yaw": lever},
        "T2": {"surge": c, "sway": -c, "yaw": -lever},
        "T3": {"surge": c, "sway": -c, "yaw": lever},
        "T4": {"surge": c, "sway": c, "yaw": -lever},
    } | {f"T{i}": {"heave": 1.0} for i in (5, 6, 7, 8)}
    thrusters = tuple(Thruster(name, np.array([coefficients[name]]), arms[name]) for name in arms)
    C = np.array([coefficients[name] for name in arms])
    sides = {"T1": "T3", "T3": "T1", "T2": "T4", "T4": "T2"}
    interactions = (
        Interaction("eta_hull", ("T1", "T2"), -1),
        Interaction("eta_hull", ("T3", "T4"), 1),
        Interaction("eta_pair", tuple(sides), 0, sides),
    )
    return Installation(thrusters, np.diag((own * C) ** 2) + gain**2 * np.outer(C, C), interactions)


def drawn(rng, number):
    """A vehicle at random: eta 0.4 to 1, a current in every second one, everything else within a factor of 1.5."""

    def about(value):
        return value * np.exp(rng.uniform(-0.4, 0.4))

    axes = {a: Body(about(b.inertia), about(b.linear), about(b.quadratic)) for a, b in BODIES.items()}
    C = {f"T{i}": float(about(0.4)) for i in range(1, 9)}
    psi, speed = rng.uniform(0, 2 * np.pi), rng.uniform(0.05, 0.2) if number % 2 else 0.0
    hull = romeo(
        C, axes, rng.uniform(0.4, 1), rng.uniform(0.4, 1), (speed * cos(psi), speed * sin(psi)),
    )  # fmt: skip
    hull = replace(hull, buoyancy=float(rng.uniform(-10, 10)))
    gain = GAIN_STD * rng.standard_normal()
    stated = {name: c * (1 + gain + OWN_STD * rng.standard_normal()) for name, c in C.items()}
    return hull, installation(stated)


@dataclass
class Identified:
    hull: object
    drag: dict = field(default_factory=dict)
    inertia: dict = field(default_factory=dict)

    def own(self, axis):
        """What this axis alone has a say in."""
        keep = ("m", "k", "k2", "buoyancy[heave-3]") + (("eta_hull", "eta_pair") if axis == "surge" else ())
        estimate = self.inertia[axis].estimate
        return estimate.select([n for n in estimate.names if n in keep])


def identify(hull, vehicle, rng, axes=AXES) -> Identified:
    """Both steps on each axis; surge first: it tells the others what the efficiencies are."""
    steady = {axis: recordings_of(hull, TRIALS[axis](), rng) for axis in axes}
    moving = {axis: recordings_of(hull, sines(axis), rng) for axis in axes}
    everything = [r for group in (*steady.values(), *moving.values()) for r in group]
    experiments = {"heave-sine-1": "heave-3", "heave-sine-2": "heave-3"}
    found = identify_vehicle(everything, vehicle, CampaignFacts(ballast=experiments))
    out = Identified(hull)
    for axis, result in found.axes.items():
        out.drag[axis], out.inertia[axis] = result.drag, result.inertia
    return out


def compared(rng):
    """Every way to the inertia of surge of one vehicle: name, fit, truth, CPU seconds."""
    hull, vehicle = drawn(rng, 1)
    fit = identify_drag(recordings_of(hull, TRIALS["surge"](), rng), vehicle, "surge")
    known = fit.estimate
    moving = [trial(r, vehicle, "surge") for r in recordings_of(hull, sines("surge"), rng)]
    ways = (
        lambda: output_error(moving, known),
        lambda: by_derivative(moving, known),
        lambda: by_kalman(moving, known),
        lambda: by_annealing(moving, known, {"m": (100.0, 5000.0)}, rng, rounds=12),
    )
    for way in ways:
        begin = process_time()
        found = way()
        yield found.method, found, hull.axes["surge"].inertia, process_time() - begin


def truth_of(hull, axis, names):
    body = hull.axes[axis]
    values = {
        "m": body.inertia, "k": body.linear, "k2": body.quadratic, "eta_hull": hull.eta_hull,
        "eta_pair": hull.eta_pair, "current_north": hull.current[0], "current_east": hull.current[1],
    }  # fmt: skip
    values |= {f"C[{n}]": t.C for n, t in hull.thrusters.items()}
    for i, weight in enumerate((-40.0, -15.0, 2.0, 20.0, 45.0)):
        values[f"buoyancy[heave-{i + 1}]"] = hull.buoyancy + weight
    return np.array([values[name] for name in names])


def distance(estimate, truth):
    """Squared Mahalanobis distance: chi-square with as many degrees of freedom as parameters."""
    error = estimate.mean - truth
    return float(error @ np.linalg.solve(estimate.cov, error))
