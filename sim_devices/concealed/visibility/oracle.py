"""How visible an effect is: the sigma at which an oracle sees it that knows effect, shape and noise covariance.

d'^2 = x' K^-1 x - x' K^-1 B (B' K^-1 B)^-1 B' K^-1 x with x the noise-free difference that the effect makes, K the
covariance of the noise and B the baseline's own columns: V|V| of the command and one zero per run. Student's t noise is
taken as Gaussian of the same variance: an oracle that knew the tails would see a little more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sim_devices.concealed.cases.definition import Case, Concealed
from sim_devices.concealed.cases.knob import LEAST
from sim_devices.concealed.visibility.projection import Projection, Screen, signals
from sim_devices.world.noise_law import scaled

Floats = NDArray[np.float64]

CLOSE = 0.03
"""relative error of d' at which the search for the amount ends; the noise then takes up the rest."""
QUIETEST, LOUDEST = 3e-5, 0.05
"""Noise of the cell as a share of the largest thrust: what can still be called a load cell."""
LEVEL = 0.15
"""relative: how far the strengths of several effects in one case may be from the one asked for."""
EVALUATIONS = 14


class OutOfReach(ValueError):
    """Such a run cannot show this effect at this strength with any noise that a cell has: draw another."""


def strength(case: Case, effect: str) -> float:
    """Sigma (d') of `effect` in this case, in the presence of the others. Raises ValueError when it is not there."""
    if effect not in {c.effect for c in case.effects}:
        raise ValueError(f"strength: expected one of {[c.effect for c in case.effects]}, got {effect!r}")
    without = signals(case, frozenset({effect}))
    return Projection(case, signals(case)).strength(signals(case), without)


def measured(case: Case) -> Case:
    """The case with the strength of each of its effects written beside it."""
    whole = signals(case)
    projection = Projection(case, whole)
    seen = (projection.strength(whole, signals(case, frozenset({c.effect}))) for c in case.effects)
    return replace(case, effects=tuple(replace(c, seen=d) for c, d in zip(case.effects, seen, strict=True)))


def scaled_to(case: Case, effect: str, d_prime: float) -> Case:
    """The case with as much of `effect` as the oracle sees at `d_prime` sigma.

    The amount is searched within its physical bounds with noise taken as stationary (frequency domain, fast); then the
    noise is scaled so that the exact strength is met, also where the amount jumps over it or its bounds end before.
    Raises OutOfReach when that noise would be no load cell's.
    """
    without = signals(case, frozenset({effect}))
    found = _with_strength(case, effect, Screen(case, without), without, d_prime)
    reached = Projection(found, without).strength(signals(found), without)
    return _with_noise(found, effect, reached / d_prime)


def levelled(case: Case, d_prime: float) -> Case:
    """The case with each of several effects at `d_prime`, the noise left as it is, strengths written beside.

    The noise that suited the last effect may have been too loud for the first. Raises OutOfReach when an amount meets
    its bounds.
    """
    for effect in [c.effect for c in case.effects]:
        case = _relevelled(case, effect, d_prime)
    case = measured(case)
    for found in case.effects:
        _require_level(found.effect, found.seen, d_prime)
    return case


def added_at(case: Case, effect: str, d_prime: float) -> Case:
    """The case with as much of one of its effects as is seen at `d_prime`; the others and the noise stay as they are.

    Raises OutOfReach when its amount meets its bounds.
    """
    without = signals(case, frozenset({effect}))
    found = _relevelled(_with_strength(case, effect, Screen(case, without), without, d_prime), effect, d_prime)
    _require_level(effect, strength(found, effect), d_prime)
    return found


def _relevelled(case: Case, effect: str, d_prime: float) -> Case:
    """One more search for its amount, where the exact strength is not the one that the screen saw."""
    off = strength(case, effect) / d_prime
    if abs(off - 1.0) <= CLOSE or off <= 0.0:
        return case
    without = signals(case, frozenset({effect}))
    screen = Screen(case, without)
    here = screen.strength(signals(case), without)  # times 1 / off: what it sees where the oracle sees d_prime
    return _with_strength(case, effect, screen, without, here / off)


def _require_level(effect: str, seen: float, d_prime: float) -> None:
    """Raises OutOfReach."""
    if abs(seen / d_prime - 1.0) > LEVEL:
        raise OutOfReach(f"{effect} is seen at {seen:.3g} sigma beside the others: draw another case")


def _with_strength(case: Case, effect: str, screen: Screen, without: list[Floats], target: float) -> Case:
    """As much of `effect` as the screen sees at `target`, within its bounds."""
    shape = next(c.shape for c in case.effects if c.effect == effect)

    def seen(amount: float) -> float:
        return screen.strength(signals(with_amount(case, effect, amount)), without)

    lowest = shape.lowest or LEAST * shape.highest
    return with_amount(case, effect, _searched(seen, target, shape.first, lowest, shape.highest))


def with_amount(case: Case, effect: str, amount: float) -> Case:
    """The case with another amount of one effect."""
    changed = tuple(Concealed(c.shape, amount) if c.effect == effect else c for c in case.effects)
    return replace(case, effects=changed)


def loudness(case: Case) -> float:
    """Noise of the cell at a third of the largest thrust, as a share of the largest thrust."""
    law = case.noise
    variance = law.white**2 + (law.proportional * case.scale.thrust / 3.0) ** 2 + sum(s.std**2 for s in law.slow)
    return float(np.sqrt(variance + (law.peak.std**2 if law.peak else 0.0)) / case.scale.thrust)


def _with_noise(case: Case, effect: str, factor: float) -> Case:
    """Strength falls in exact proportion to the noise."""
    loud = loudness(case) * factor
    if not QUIETEST < loud < LOUDEST:
        raise OutOfReach(
            f"{effect} needs noise of {loud:.2g} of the largest thrust to be seen as asked; expected {QUIETEST:.2g} to "
            f"{LOUDEST:.2g}: draw another case"
        )
    louder = replace(case, noise=scaled(case.noise, factor))
    return louder if len(case.effects) > 1 else measured(louder)


def _searched(seen: Callable[[float], float], target: float, amount: float, lowest: float, highest: float) -> float:
    """Amount that is seen at `target`: false position on log d' against log amount, which is nearly a straight line.

    `amount` is tried first.
    """
    low, high, best = _Point(0.0, 0.0), _Point(np.inf, np.inf), _Point(lowest, 0.0)
    for _ in range(EVALUATIONS):
        point = _Point(amount, seen(amount))
        if abs(point.log_ratio(target)) <= abs(best.log_ratio(target)):
            best = point
        at_bound = amount >= highest if point.seen < target else amount <= lowest
        if abs(point.seen / target - 1.0) < CLOSE or at_bound:
            break
        low, high = (point, high) if point.seen < target else (low, point)
        amount = min(max(_next(low, high, target), lowest), highest)
        if high.amount - low.amount < 1e-3 * high.amount:
            break
    return best.amount


@dataclass(frozen=True, slots=True)
class _Point:
    amount: float
    seen: float

    def log_ratio(self, target: float) -> float:
        return float(np.log(self.seen / target)) if self.seen > 0.0 else -np.inf


def _next(low: _Point, high: _Point, target: float) -> float:
    if low.seen <= 0.0:  # nothing seen below: in proportion, and not above half
        return high.amount * min(max(target / high.seen, 1e-4), 0.5) if np.isfinite(high.seen) else 5.0 * low.amount
    if not np.isfinite(high.seen):
        return low.amount * min(target / low.seen * 1.02, 20.0)
    slope = np.log(high.amount / low.amount) / np.log(high.seen / low.seen)
    share = np.log(target / low.seen) * slope / np.log(high.amount / low.amount)
    return float(low.amount * (high.amount / low.amount) ** min(max(share, 0.1), 0.9))
