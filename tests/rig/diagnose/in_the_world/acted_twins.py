"""Terms as a twin's file has them, what the twin predicts of them and what the simulated bench acts."""

from __future__ import annotations

import numpy as np

from identification.mismatch.compare.simulation import Drive, simulate
from identification.physics.term import Scale
from identification.twin import TERMS, Twin, TwinNoise, TwinTerm
from sim_devices.world.settings import read_world
from sim_devices.world.sweep import sweep
from sim_devices.world.twin import world_of

SCALE = Scale(20.0, "V", 160.0, 300.0, 0.01, 1.0, 170.0, 0.2, 7.0)


def entry(effect, form, *values):
    """A term as a twin's file has it, at 20 V."""
    names = TERMS[effect, form].parameters(SCALE)
    parameters = {p.name: {"value": v, "unit": p.unit} for p, v in zip(names, values, strict=True)}
    return {"effect": effect, "form": form, "parameters": parameters, "scale": {"driver": 20.0}}


def file_of(*terms, **more):
    return {"driver": "command_voltage", "rate_per_driver": 2.0, "C": 0.4, "terms": list(terms), **more}


def told(terms, volts, seconds):
    """What the twin of these terms predicts of a hold, N."""
    kept = tuple(
        TwinTerm(t["effect"], t["form"], {n: p["value"] for n, p in t["parameters"].items()}, SCALE) for t in terms
    )
    quiet = TwinNoise(0.0, 0.0, (), (), (), ())
    twin = Twin("T", "command_voltage", 0.4, kept, (), quiet, (), 0.1, 20.0, 2.0)
    found = simulate(twin, Drive(np.array([0.0]), np.array([volts])), np.arange(0.0, seconds - 0.05, 0.1))
    return found.thrust


def acted(terms, volts, seconds):
    """What the simulated bench makes of it, N."""
    thruster, effects = world_of(file_of(*terms))
    settings = read_world({"thrusters": {"T": thruster}, "effects": effects})
    n = round(seconds / 0.1)
    return sweep(settings, 0.1, np.full(n, volts), np.zeros(n), np.full(n, 18.0)).reading
