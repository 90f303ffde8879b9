"""What another effect of the world would leave unexplained: which names can be told apart from one recording at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sim_devices.concealed.cases.definition import Case, Concealed
from sim_devices.concealed.cases.forms import FORMS, NEIGHBOURS
from sim_devices.concealed.cases.knob import Shape
from sim_devices.concealed.cases.needs import NEEDS_DRIFT, NEEDS_FLOW
from sim_devices.concealed.cases.shapes import shape
from sim_devices.concealed.visibility.projection import Screen, signals

Floats = NDArray[np.float64]

DRAWS = 4
"""Settings of the inner parameters (time constants, onsets) that each form of a rival is tried at first."""
SEARCHED = 3
"""Rivals, the nearest first, whose inner parameters are then searched."""
STEPS = (2.0, 1.4, 1.15)
"""Factors by which one of them is moved up and down while that helps."""
MOST_MOVES = 4
"""With one factor."""


@dataclass(frozen=True, slots=True)
class Twin:
    """The best that `rival` does in place of the effect: an oracle still sees `left` sigma."""

    rival: str
    form: str
    left: float


def twins(case: Case, effect: str, rivals: Sequence[str], rng: np.random.Generator) -> list[Twin]:
    """Each rival's best stand-in for `effect`, nearest first. Noise taken as stationary (`projection.Screen`).

    A rival is scaled as a linear column, by an amount of its own sign, near the strength of the effect: exact in the
    limit of small amounts. Inner parameters are drawn, those of the nearest rivals then searched. A rival that needs a
    flow or a water temperature that this run does not change leaves everything.
    """
    without = signals(case, frozenset({effect}))
    screen = Screen(case, without)
    x = signals(case)
    energy = screen.product(x, x, without)
    oracle = _Oracle(case, effect, screen, x, without, energy)
    found = []
    for rival in rivals:
        if rival == effect or (rival in NEEDS_FLOW and not _flows(case)):
            continue
        if rival in NEEDS_DRIFT and not case.temperature_drift:
            continue
        tried = [_drawn(oracle, rival, form, rng) for form in (*FORMS.get(rival, ("",)), *NEIGHBOURS.get(rival, ()))]
        found.append(min(tried, key=lambda each: each[0].left))
    found.sort(key=lambda each: each[0].left)
    nearest = [_searched(oracle, *each) for each in found[:SEARCHED]]
    return sorted([*nearest, *(twin for twin, _ in found[SEARCHED:])], key=lambda twin: twin.left)


@dataclass(frozen=True, eq=False, slots=True)
class _Oracle:
    """What is compared with what."""

    case: Case
    effect: str
    screen: Screen
    x: list[Floats]
    without: list[Floats]
    energy: float

    def left(self, drawn: Shape) -> float:
        """Sigma that the rival leaves, scaled as it fits best."""
        instead = _signals_of(self.case, self.effect, drawn, self.screen, self.without, self.energy)
        own = self.screen.product(instead, instead, self.without)
        shared = self.screen.product(self.x, instead, self.without)
        fits = own > 0.0 and (shared > 0.0 or drawn.effect in BOTH_SIGNS)
        return float(np.sqrt(max(self.energy - shared * shared / own if fits else self.energy, 0.0)))


def _drawn(oracle: _Oracle, rival: str, form: str, rng: np.random.Generator) -> tuple[Twin, Shape]:
    """The best of some settings."""
    shapes = [shape(rival, oracle.case.scale, rng, form) for _ in range(DRAWS)]
    distinct = {repr(sorted(s.fixed.items())): s for s in shapes}  # a rival without inner parameters is tried once
    left, best = min(((oracle.left(drawn), drawn) for drawn in distinct.values()), key=lambda each: each[0])
    return Twin(rival, form, left), best


def _searched(oracle: _Oracle, twin: Twin, drawn: Shape) -> Twin:
    """The best round a setting: its inner parameters moved one at a time, by ever smaller factors."""
    left = twin.left
    names = [name for name, value in drawn.fixed.items() if isinstance(value, float) and value > 0.0]
    for factor in STEPS:
        for name in names:
            for by in (factor, 1.0 / factor):
                for _ in range(MOST_MOVES):
                    moved = replace(drawn, fixed={**drawn.fixed, name: drawn.fixed[name] * by})
                    if not (new := oracle.left(moved)) < left:
                        break
                    drawn, left = moved, new
    return replace(twin, left=left)


BOTH_SIGNS = frozenset(
    {
        "load_cell_creep",
        "load_cell_nonlinearity",
        "load_cell_even_bend",
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
    amount = max(drawn.start or 0.05 * drawn.highest, lowest)
    for _ in range(2):
        instead = signals(replace(case, effects=(*others, Concealed(drawn, amount))))
        own = screen.product(instead, instead, without)
        amount = min(max(amount * float(np.sqrt(energy / own)) if own > 0.0 else drawn.highest, lowest), drawn.highest)
    return instead


def _flows(case: Case) -> bool:
    return any(speed for run in case.runs for _, speed in run.flow)
