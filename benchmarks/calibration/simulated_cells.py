"""Cells drawn at random in the simulated world, under weights with errors of their own, and what is true of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.calibration.loads import Load, Place, Weight, force_of
from identification.calibration.steps import Steps, joined_steps, windows_of
from identification.recording import Floats
from rig.calibrate.loads_file import Pace
from sim_devices.world import World
from sim_devices.world.hysteresis import Plays
from sim_devices.world.settings import WorldSettings, read_world

SET = {
    name: Weight(name, mass, mass * 8e-6, 7950.0, 80.0)
    for name, mass in (("1kg", 1.0), ("2kg", 2.0), ("2kg-dot", 2.0), ("5kg", 5.0), ("10kg", 10.0))
}
PLACE = Place(9.8056, 3e-5, 1.2, 0.04, 1.0, 5e-5)
CORRELATION = 1.0
LADDER = ((), ("2kg",), ("5kg",), ("10kg",), ("10kg", "5kg"), ("10kg", "5kg", "2kg", "2kg-dot", "1kg"))
RANGE = 20.0 * 9.8056
"""N"""
DT = 0.05
"""s of a step of the world, and between two readings."""
SETTLE, HOLD = 4.0, 6.0
DIGIT = 0.001
"""N"""
DENSE = 400


PACE = Pace(LADDER, (1, -1), 2, settle=SETTLE, hold=HOLD)


def course() -> list[Load]:
    """What is read of the plan: up and down in both directions, twice."""
    loads, unread = PACE.loads()
    return [load for at, load in enumerate(loads) if at not in unread]


@dataclass(frozen=True)
class Drawn:
    """One cell in its world, and the weights and the place as they really are."""

    settings: WorldSettings
    weights: dict[str, Weight]
    place: Place

    def truth(self) -> tuple[Floats, Floats, Floats]:
        """Forces (n,) N from none to the end of the range, and readings (n,) N forward and backward: the middle
        between up and down, at the usual age of a reading under a steady load."""
        effects, cell = self.settings.effects, self.settings.cell
        up, down = np.linspace(0.0, RANGE, DENSE), np.linspace(RANGE, 0.0, DENSE)
        path = np.concatenate([up, down, up, down, -up, -down, -up, -down])
        creep = effects["load_cell_creep"]
        aged = path * (1.0 - creep["share"] * np.expm1(-(SETTLE + HOLD / 2.0) / creep["time_constant"]))
        odd, even = effects["load_cell_nonlinearity"], effects["load_cell_even_bend"]
        bent = aged + odd["quadratic"] * aged * np.abs(aged) + odd["cubic"] * aged**3
        bent = bent + even["coefficient"] * bent**2
        plays = Plays(cell.hysteresis, cell.hysteresis_reach)
        read = np.array([value + plays.follow(float(value)) for value in bent])
        _, _, a, b, _, _, c, d = np.split(read * (1.0 + cell.gain_error) + cell.zero_offset, 8)
        return up, 0.5 * (a + b[::-1]), 0.5 * (c + d[::-1])


def drawn(rng: np.random.Generator) -> Drawn:
    """Bends of some 0.1 % of the range, hysteresis of 0.02 %, creep of 0.03 %, a gain that is off by some per cent."""
    bend = 1e-3 / RANGE * rng.standard_normal(2)
    tables = {
        "thrusters": {"T": {"C": 0.4}},
        "cell": {"gain_error": 0.02 * rng.standard_normal(), "zero_offset": float(rng.normal(0.0, 1.0)),
                 "hysteresis": float(rng.uniform(0.01, 0.08)), "hysteresis_reach": RANGE},
        "noise": {"thrust": {"white": 0.05, "slow": 0.02, "slow_time": 0.5}},
        "effects": {
            "load_cell_creep": {"share": float(rng.uniform(-5e-4, 5e-4)), "time_constant": float(rng.uniform(5, 40))},
            "load_cell_nonlinearity": {"quadratic": float(bend[0]), "cubic": float(1e-3 / RANGE**2 * rng.normal())},
            "load_cell_even_bend": {"coefficient": float(bend[1])},
        },
    }  # fmt: skip
    shared = rng.standard_normal() * np.sqrt(CORRELATION)
    own = rng.standard_normal(len(SET)) * np.sqrt(1.0 - CORRELATION)
    rho = 80.0 * rng.standard_normal()
    weights = {
        name: replace(weight, mass=weight.mass + weight.std * (shared + each), density=weight.density + rho)
        for (name, weight), each in zip(SET.items(), own, strict=True)
    }
    place = replace(
        PLACE,
        gravity=PLACE.gravity + PLACE.gravity_std * rng.standard_normal(),
        air_density=PLACE.air_density + PLACE.air_density_std * rng.standard_normal(),
        lever=PLACE.lever + PLACE.lever_std * rng.standard_normal(),
    )
    return Drawn(read_world(tables), weights, place)


def read(cell: Drawn, loads: list[Load], rng: np.random.Generator, hung: list[Load] | None = None) -> Steps:
    """What the world's cell says under the loads that really hang (`hung`; None: those that are stated)."""
    world = World(cell.settings, rng)
    parts, unread = [], []
    planned, skipped = PACE.loads()
    pairs = iter(zip(loads, hung or loads, strict=True))
    for at, only in enumerate(planned):
        stated, load = (only, only) if at in skipped else next(pairs)
        begun = world.state.t
        world.state.hung = force_of(load, cell.weights, cell.place)
        rows = []
        if at in skipped:
            unread.append((begun, force_of(load, SET, PLACE)))
        while world.state.t < begun + SETTLE + HOLD - 0.5 * DT:
            world.step(DT, 0.0)
            rows.append((world.state.t, round(world.sample("thrust") / DIGIT) * DIGIT))
        if at in skipped:
            continue
        table = np.array(rows)
        times, means = windows_of(table[:, 0], table[:, 1], begun + SETTLE, 2)
        parts.append((force_of(stated, SET, PLACE), begun, times, means, float("nan")))
    return joined_steps(parts, unread)
