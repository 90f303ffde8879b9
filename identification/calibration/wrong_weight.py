"""The step whose weight is not what was typed, and which weight it probably was.

Each step is judged by the others: its externally studentised residual (Cook and Weisberg, Residuals and Influence in
Regression, 1982, 2.2.2) against Student's t, by Bonferroni over all steps. One that fails is left out and the rest is
judged again, for a second one hides behind the first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from identification.calibration.estimate import Estimated, estimated
from identification.calibration.loads import Load, Place, Weight, force_of
from identification.calibration.steps import Steps
from identification.estimation.tails import student_sf
from identification.recording import Floats

WRONG = 0.01
"""Probability that some step of a sound calibration is called wrong."""
MOST_WRONG = 0.2
"""Of the steps: with more of them nobody can say which are right."""
MATERIAL = 0.2
"""Of the smallest weight: what is off by less was no wrong weight, and a sum of weights that is so near is meant."""
ROUNDS = 6
EXHAUSTIVE = 12
"""Weights of a set up to which every combination is tried; of a larger one those with up to three pieces changed."""
CHANGED = 3
WITHIN = 4.0
"""Standard deviations within which a combination explains the reading."""


@dataclass(frozen=True, slots=True)
class WrongStep:
    """One step whose reading does not go with the load that was stated."""

    step: int
    """From 0, as given."""
    stated: float
    """N"""
    expected: float
    """N, by its reading and the other steps."""
    std: float
    """N, of that."""
    p_value: float
    """Of so large a residual in any of the steps."""
    probable: Load | None = None
    """What of the set it was, where something fits."""


def wrong_steps(steps: Steps) -> tuple[WrongStep, ...]:
    """In the order of the steps, each as those that are left see it. Raises ValueError as `estimated`."""
    kept = np.arange(steps.count)
    found: list[tuple[int, float]] = []
    while len(found) < max(int(MOST_WRONG * steps.count), 1):
        try:
            worst = _worst(estimated(_only(steps, kept)))
        except ValueError:
            if not found:
                raise
            break
        if worst is None:
            break
        found.append((int(kept[worst[0]]), worst[1]))
        kept = np.delete(kept, worst[0])
    return tuple(_seen_by(steps, kept, step, p_value) for step, p_value in sorted(found))


def _only(steps: Steps, kept: NDArray[np.int64]) -> Steps:
    return steps.without(np.isin(np.arange(steps.count), kept))


def _spare(fit: Estimated) -> Floats:
    """(n,): share of its own residual that each step leaves."""
    return np.maximum(1.0 - fit.leverage, 1e-9)


def _worst(fit: Estimated) -> tuple[int, float] | None:
    """Step and p-value of the one that is wrong; None when all go together. Raises ValueError as `estimated`."""
    spare = _spare(fit)
    size: Floats = np.where(spare > 1e-6, np.abs(fit.residual) / np.sqrt(spare), 0.0)
    step = int(np.argmax(size))
    others = estimated(fit.steps.without(np.arange(fit.steps.count) != step))
    if others.dof < 1.0:
        return None
    p_value = min(fit.steps.count * 2.0 * float(student_sf(float(size[step]) / others.scatter, others.dof)), 1.0)
    return (step, p_value) if p_value < WRONG else None


def _seen_by(steps: Steps, kept: NDArray[np.int64], step: int, p_value: float) -> WrongStep:
    """What the steps that are kept expect of this one."""
    fit = estimated(_only(steps, np.append(kept, step)))
    at = int(np.searchsorted(kept, step))
    spare = float(_spare(fit)[at])
    others, stated = estimated(_only(steps, kept)), float(steps.force[step])
    gain = others.value("gain")
    wanted = _bent(others, stated) + float(fit.residual[at]) / spare
    expected = stated
    for _ in range(ROUNDS):  # bends are small beside the gain: each round leaves a share of them
        expected += (wanted - _bent(others, expected)) / gain
    return WrongStep(step, stated, expected, others.scatter / np.sqrt(spare) / abs(gain), p_value)


def _bent(fit: Estimated, force: float) -> float:
    """N that the curve adds to the zero."""
    bends = fit.value("even") * force + fit.value("odd") * abs(force) + fit.value("cubic") * force**2
    return force * (fit.value("gain") + bends)


def doubtful_steps(
    steps: Steps, loads: Sequence[Load], weights: Mapping[str, Weight], place: Place
) -> tuple[WrongStep, ...]:
    """Those that are off by so much that another weight may have hung, with the weight that it probably was.

    Raises ValueError as `estimated`.
    """
    least = _material(weights, place)
    wrong = [each for each in wrong_steps(steps) if abs(each.expected - each.stated) > least]
    return tuple(with_guess(each, loads[each.step], weights, place) for each in wrong)


def _material(weights: Mapping[str, Weight], place: Place) -> float:
    """N"""
    return MATERIAL * min(abs(force_of(Load((name,)), weights, place)) for name in weights)


def with_guess(wrong: WrongStep, load: Load, weights: Mapping[str, Weight], place: Place) -> WrongStep:
    """With the combination of the set that goes with the reading and changes least of what was stated."""
    reach = max(WITHIN * wrong.std, _material(weights, place))
    best: tuple[int, float, Load] | None = None
    for other in _others(load, tuple(weights)):
        away = abs(force_of(other, weights, place) - wrong.expected)
        key = (_changes(load, other), away)
        if away <= reach and (best is None or key < best[:2]):
            best = (*key, other)
    return replace(wrong, probable=best[2] if best else None)


def _others(load: Load, names: Sequence[str]) -> list[Load]:
    if len(names) <= EXHAUSTIVE:
        chosen = [part for size in range(len(names) + 1) for part in combinations(names, size)]
    else:
        changes = [part for size in range(CHANGED + 1) for part in combinations(names, size)]
        chosen = [tuple(name for name in names if (name in load.weights) != (name in change)) for change in changes]
    found = [Load(part, way) for part in chosen for way in (load.direction, -load.direction)]
    return [other for other in found if set(other.weights) != set(load.weights) or other.direction != load.direction]


def _changes(load: Load, other: Load) -> int:
    """Pieces put on in place of others count once, as a mix-up of two does; another direction counts as one."""
    on, off = set(other.weights) - set(load.weights), set(load.weights) - set(other.weights)
    turned = bool(other.weights and load.weights and other.direction != load.direction)
    return max(len(on), len(off)) + turned


def sentence(wrong: WrongStep, load: Load, unit: str = "N") -> str:
    """For the person at the bench, who shall look at the weight before it is believed."""
    says = f"step {wrong.step + 1}: {load.said} ({wrong.stated:.5g} {unit}) was stated, but the reading says "
    says += f"{wrong.expected:.5g} {unit}"
    if wrong.probable is None:
        return f"{says}; no combination of the set gives that: did it hang free, with nothing else on the stand?"
    return f"{says}: probably it was {wrong.probable.said}; look at that step and measure it again"
