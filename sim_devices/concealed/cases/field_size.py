"""Effects as a test stand has them: which of them, and how much of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.optimize import brentq

from sim_devices.concealed.cases.definition import Case, Concealed, settings
from sim_devices.concealed.cases.knob import LEAST, Shape
from sim_devices.concealed.cases.shapes import shape
from sim_devices.world.sweep import sweep

FIELD: Final[Mapping[str, tuple[float, float]]] = {
    "dead_band": (0.02, 0.10),
    "asymmetry": (0.05, 0.40),
    "winding_resistance": (0.05, 0.35),
    "motor_lag": (0.05, 0.30),
    "inflow_dynamics": (0.10, 0.50),
    "heating": (0.01, 0.08),
    "recirculation": (0.01, 0.08),
}
"""Least and most amount: share of the largest command, of the thrust in the other direction, of the largest command
lost; s; share of the step in thrust; change of the largest thrust once warm, and once the water goes round."""
LONG, POINTS = 20.0, 2000
"""Time constants, and points of the grid, after which a motor is as warm as it gets."""


def of_field_size(effects: Sequence[str], case: Case, rng: np.random.Generator) -> tuple[Concealed, ...]:
    """Each of FIELD's `effects` for the thruster of `case`, its amount drawn log-uniformly.

    Magnets warm alone in a motor whose winding takes no voltage: beside a winding loss it is the copper that warms.
    """
    forms = {"heating": "winding"} if "winding_resistance" in effects else {}
    return tuple(_one(effect, case, rng, forms.get(effect, "")) for effect in effects)


def _one(effect: str, case: Case, rng: np.random.Generator, form: str) -> Concealed:
    low, high = FIELD[effect]
    drawn = shape(effect, case.scale, rng, form)
    if effect != "heating":
        return Concealed(drawn, _log(rng, low, high))
    share = _log(rng, low, min(high, warm_change(case, drawn, drawn.highest)))
    return Concealed(_per_change(case, drawn, share), share)


def _per_change(case: Case, heating: Shape, share: float) -> Shape:
    """The shape whose amount is the change of thrust, for this one amount of it."""
    least = LEAST * heating.highest
    own = brentq(lambda amount: warm_change(case, heating, amount) - share, least, heating.highest, xtol=1e-3 * least)
    return replace(heating, gain=heating.gain * own / share, highest=share)


def warm_change(case: Case, heating: Shape, amount: float) -> float:
    """Share of the thrust that heating alone adds or takes at the largest command, held until nothing warms more."""
    alone = replace(case, effects=(Concealed(heating, amount),), decoys={})
    slowest = max(case.thruster.heating_time, heating.fixed["time_constant"])
    still, command = np.zeros(POINTS), np.full(POINTS, case.scale.voltage)
    h = sweep(settings(alone), LONG * slowest / POINTS, command, still, still)
    return float(abs(h.thrust[-1] / case.scale.thrust - 1.0))


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
