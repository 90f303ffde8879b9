"""What another effect of the world would leave unexplained: which names can be told apart from one recording at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sim_devices.concealed.definition import Case, Concealed
from sim_devices.concealed.draw import NEEDS_DRIFT, NEEDS_FLOW
from sim_devices.concealed.projection import Screen, signals
from sim_devices.concealed.shapes import FORMS, Shape, shape

Floats = NDArray[np.float64]

DRAWS = 4
"""Settings of the inner parameters (time constants, onsets) that each form of a rival is tried at."""


@dataclass(frozen=True, slots=True)
class Twin:
    """The best that `rival` does in place of the effect: an oracle still sees `left` sigma."""

    rival: str
    form: str
    left: float


def twins(case: Case, effect: str, rivals: Sequence[str], rng: np.random.Generator) -> list[Twin]:
    """Each rival's best stand-in for `effect`, nearest first. Noise taken as stationary (`projection.Screen`).

    A rival is scaled as a linear column, by an amount of its own sign, near the strength of the effect: exact in the
    limit of small amounts, a bound from above in practice, for its inner parameters are drawn and not searched. A rival
    that needs a flow or a water temperature that this run does not change leaves everything.
    """
    without = signals(case, frozenset({effect}))
    screen = Screen(case, without)
    x = signals(case)
    energy = screen.product(x, x, without)
    found = []
    for rival in rivals:
        if rival == effect or (rival in NEEDS_FLOW and not _flows(case)):
            continue
        if rival in NEEDS_DRIFT and not case.temperature_drift:
            continue
        tried = [_left(case, effect, rival, form, screen, x, without, energy, rng) for form in FORMS.get(rival, ("",))]
        found.append(min(tried, key=lambda twin: twin.left))
    return sorted(found, key=lambda twin: twin.left)


def _left(
    case: Case,
    effect: str,
    rival: str,
    form: str,
    screen: Screen,
    x: list[Floats],
    without: list[Floats],
    energy: float,
    rng: np.random.Generator,
) -> Twin:
    left, shapes = energy, [shape(rival, case.scale, rng, form) for _ in range(DRAWS)]
    distinct = {repr(sorted(s.fixed.items())): s for s in shapes}  # a rival without inner parameters is tried once
    for drawn in distinct.values():
        instead = _signals_of(case, effect, drawn, screen, without, energy)
        own = screen.product(instead, instead, without)
        shared = screen.product(x, instead, without)
        if own > 0.0 and (shared > 0.0 or rival in BOTH_SIGNS):
            left = min(left, energy - shared * shared / own)
    return Twin(rival, form, float(np.sqrt(max(left, 0.0))))


BOTH_SIGNS = frozenset(
    {
        "load_cell_creep",
        "load_cell_nonlinearity",
        "zero_drift",
        "zero_offset",
        "linear_term",
        "torque_crosstalk",
        "gain_step",
        "rotation_coupling",
        "gain_wave",
        "periodic_disturbance",
    }
)
"""Effects whose amount may have either sign: shapes draws it."""


def _signals_of(
    case: Case, effect: str, drawn: Shape, screen: Screen, without: list[Floats], energy: float
) -> list[Floats]:
    """The rival alone in place of the effect, about as strong."""
    others = tuple(c for c in case.effects if c.effect not in (effect, drawn.effect))
    lowest = drawn.lowest or 1e-3 * drawn.highest
    amount = max(0.05 * drawn.highest, lowest)
    for _ in range(2):
        instead = signals(replace(case, effects=(*others, Concealed(drawn, amount))))
        own = screen.product(instead, instead, without)
        amount = min(max(amount * float(np.sqrt(energy / own)) if own > 0.0 else drawn.highest, lowest), drawn.highest)
    return instead


def _flows(case: Case) -> bool:
    return any(speed for run in case.runs for _, speed in run.flow)
