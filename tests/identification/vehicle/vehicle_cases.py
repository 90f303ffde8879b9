"""Monte Carlo cases of the vehicle (4.2): drag and efficiency (step one), inertia by every way there is (step two)."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from identification.comparators import by_annealing, by_kalman
from identification.estimation.maximum_likelihood import Gaussian
from identification.recording import Channel, Recording, Step
from identification.thruster.thrust_data import Unusable
from identification.vehicle.efficiency import Force, Installation, Interaction, Thruster
from identification.vehicle.inertia import by_derivative, output_error, responses
from identification.vehicle.steady_drag import identify_drag, predicted_velocities
from identification.vehicle.trials import Trial, steady_runs
from sim_devices.vehicle.campaign import ALL, FRONT, REAR, scaled
from tests.identification.estimation.monte_carlo import NOISES, Case, Draw, blockwise, drawn

FIX_SIGMA = 0.07
"""m, section 4.2.3."""
FIXES = 180
"""At 3 Hz: a run of 60 s."""
COEFFICIENTS = {f"T{i}": 0.4 for i in range(1, 5)}
STEP_ONE = {"k": 170.0, "k2": 250.0, "eta_hull": 0.7, "eta_pair": 0.85} | {f"C[T{i}]": 0.4 for i in range(1, 5)}
SHOWN = ("k", "k2", "eta_hull", "eta_pair")


def installation(coefficients):
    """Four horizontal thrusters at 45 degrees: 0.4 % of scatter each and 0.5 % of the cell's gain in common."""
    thrusters = tuple(Thruster(T, np.array([c]), {"surge": np.sqrt(0.5)}) for T, c in coefficients.items())
    C = np.array(list(COEFFICIENTS.values()))
    sides = {"T1": "T3", "T3": "T1", "T2": "T4", "T4": "T2"}
    interactions = (
        Interaction("eta_hull", ("T1", "T2"), -1),
        Interaction("eta_hull", ("T3", "T4"), 1),
        Interaction("eta_pair", tuple(sides), 0, sides),
    )
    return Installation(thrusters, np.diag((0.004 * C) ** 2) + 0.005**2 * np.outer(C, C), interactions)


@lru_cache
def still():
    """Recordings of constant-velocity runs with nothing moving yet, one for each group of thrusters."""
    out = []
    for name, group in (("front", FRONT), ("rear", REAR), ("all", ALL)):
        holds = [scaled(group, sign * level) for level in (8.0, 12.0, 16.0, 20.0) for sign in (1.0, -1.0)]
        edges = np.arange(len(holds)) * FIXES / 3
        commands = [
            Channel(
                f"u{T}", "command", "command_voltage", "V", edges, np.array([h.get(T, 0.0) for h in holds]), thruster=T
            )
            for T in COEFFICIENTS
        ]
        t = np.arange(FIXES * len(holds)) / 3
        fixes = Channel("x", "acoustic", "position", "m", t, np.zeros(t.size), axis="surge")
        steps = tuple(Step(i, "hold", 1.0, float(a), float(a) + FIXES / 3 - 0.01) for i, a in enumerate(edges))
        out.append(Recording(name, "v", (*commands, fixes), steps=steps, kind="vehicle"))
    return out


def _with_positions(recordings, positions):
    out = []
    for one, x in zip(recordings, positions, strict=True):
        *commands, fixes = one.channels
        out.append(replace(one, channels=(*commands, replace(fixes, value=x))))
    return out


@lru_cache
def step_one_truth(noise):
    """Velocities, and the gains of the efficient estimator on noise and on the error of the calibration."""
    exact = installation(COEFFICIENTS)
    shaken = [r.channels[-1].time + 1e-3 * np.sin(7 * r.channels[-1].time) for r in still()]
    runs = steady_runs(_with_positions(still(), shaken), exact, "surge")
    names, theta = tuple(STEP_ONE), np.array(list(STEP_ONE.values()))

    def speeds(at):
        return predicted_velocities(runs, names, at, {})

    step = 1e-5 * theta
    J = ((speeds(theta + np.diag(step)) - speeds(theta - np.diag(step))) / (2 * step[:, None])).T
    line = np.column_stack([np.ones(FIXES), np.arange(FIXES) / 3])
    weighed = blockwise(noise, [FIXES], FIX_SIGMA)(line)
    cov = np.linalg.inv(line.T @ weighed)
    slope = (cov @ weighed.T)[1]
    prior = np.zeros((theta.size, theta.size))
    at = [names.index(f"C[T{i}]") for i in range(1, 5)]
    prior[np.ix_(at, at)] = np.linalg.inv(exact.cov)
    bound = np.linalg.inv(J.T @ J / cov[1, 1] + prior)
    return speeds(theta[None])[0], slope, bound @ J.T / cov[1, 1], bound @ prior[:, at], bound


def step_one(noise):
    truth = np.array([STEP_ONE[name] for name in SHOWN])
    L = np.linalg.cholesky(installation(COEFFICIENTS).cov)

    def draw(rng):
        v, slope, gain, known, bound = step_one_truth(noise)
        e = FIX_SIGMA * np.array([drawn(noise, rng, FIXES) for _ in v])
        x = (v[:, None] * np.arange(FIXES) / 3 + e).reshape(3, -1)
        wrong = L @ rng.standard_normal(4)
        stated = {name: c + w for (name, c), w in zip(COEFFICIENTS.items(), wrong, strict=True)}
        fit = identify_drag(_with_positions(still(), x), installation(stated), "surge", current=False)
        reference = (gain @ (e @ slope) + known @ wrong)[:4]
        std = np.array([fit.estimate.std_of(name) for name in SHOWN])
        value = np.array([fit.estimate[name] for name in SHOWN])
        return Draw(value - truth, std, np.full(4, np.inf), reference, np.sqrt(np.diag(bound))[:4])

    return Case("drag + efficiency (step one)", noise, SHOWN, draw)


STEP_TWO = {"m": 500.0, "k": 170.0, "k2": 250.0}
KNOWN_COV = np.array([[25.0, -40.0], [-40.0, 100.0]])
"""Of k and k2 after step one."""
SWING = 193
"""Fixes of a sine trial of 64 s, two periods, at 3 Hz."""
GRID = 2 / 3
"""s: steps of the force."""
STARTS = {"x0[0]": 0.0, "v0[0]": 0.0}


@lru_cache
def swing():
    """The sine force of section 4.2.3, exact mean over each step of the grid."""
    fixes, edges = np.arange(SWING) / 3, np.arange(97) * GRID
    w = 0.1963
    integral = 60.0 * edges - 50.0 / w * np.cos(w * edges)
    mean = np.diff(integral) / GRID
    force = Force(("F",), ((),), mean[None], np.ones(1))
    return Trial("swing", "surge", "position", fixes, np.zeros(SWING), 0.0, 0.0, GRID, force)


@lru_cache
def step_two_truth(noise):
    names, theta = (*STEP_TWO, *STARTS), np.array([*STEP_TWO.values(), *STARTS.values()])
    step = np.array([0.05, 0.02, 0.02, 1e-3, 1e-4])
    (both,) = responses([swing()], names, np.vstack([theta, theta + np.diag(step), theta - np.diag(step)]), {})
    J = ((both[1:6] - both[6:]) / (2 * step[:, None])).T
    weighed = blockwise(noise, [SWING], FIX_SIGMA)(J)
    prior = np.zeros((5, 5))
    prior[1:3, 1:3] = np.linalg.inv(KNOWN_COV)
    bound = np.linalg.inv(J.T @ weighed + prior)
    return both[0], bound @ weighed.T, bound @ prior[:, 1:3], bound


def step_two(name, noise, way, shown=("m", "k", "k2"), remark=""):
    truth = np.array([STEP_TWO[n] for n in shown])
    L = np.linalg.cholesky(KNOWN_COV)

    def draw(rng):
        x, gain, known, bound = step_two_truth(noise)
        e = FIX_SIGMA * drawn(noise, rng, SWING)
        wrong = L @ rng.standard_normal(2)
        one = replace(swing(), response=x + e)
        told = Gaussian(("k", "k2"), np.array([170.0, 250.0]) + wrong, KNOWN_COV)
        fit = way([one], told, rng)
        reference, best = (gain @ e + known @ wrong)[: len(shown)], np.sqrt(np.diag(bound))[: len(shown)]
        if isinstance(fit, Unusable):
            return Draw(*np.full((3, len(shown)), np.nan), reference, best)
        value = np.array([fit.estimate[n] for n in shown])
        std = np.array([fit.estimate.std_of(n) for n in shown])
        return Draw(value - truth, std, np.full(len(shown), np.inf), reference, best)

    return Case(name, noise, shown, draw, 1, remark)


def cases():
    for noise in NOISES:
        yield step_one(noise)
    for noise in NOISES:
        yield step_two("inertia, output error", noise, lambda trials, known, rng: output_error(trials, known))
    for noise in NOISES:
        yield step_two(
            "inertia, output error, spectrum", noise,
            lambda trials, known, rng: output_error(trials, known, correlated=True),
        )  # fmt: skip
    for noise in NOISES:
        yield step_two("inertia by derivative", noise, lambda trials, known, rng: by_derivative(trials, known), ("m",))
    for noise in NOISES:
        yield step_two("inertia, Kalman smoother", noise, lambda trials, known, rng: by_kalman(trials, known))
    for noise in NOISES:
        case = step_two(
            "inertia, annealing", noise,
            lambda trials, known, rng: by_annealing(trials, known, {"m": (100.0, 5000.0)}, rng, rounds=20), ("m",),
        )  # fmt: skip
        case.cheap = 0.1
        yield case
