"""How much of a fast change a model's static terms pass on: what ticks do within an interval goes through them too.

Asked by a small change that alternates from interval to interval: what has a memory has not followed it yet.
Dynamics of a few ticks (a lag, a ring, a delay) and limits have answers of their own (sub_interval.py).
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identification.mismatch.model.model import Acting, Model, acting
from identification.mismatch.model.parameters import Theta
from identification.physics.term import Scale, Term, TermContext
from identification.recording import Floats
from identification.run_history.filters import reconstructed
from identification.run_history.history import Samples
from identification.run_history.remembered import RememberedRun

SMALL = 1e-4
"""Relative change that is tried."""
ROUNDING = 1e-9
"""Of the largest change: what is smaller is none."""
MOST_GAIN = 5.0
"""Where a curve is steeper, an interval is no place to speak of its slope."""
ROTOR = ("command", "rotor")


def rotor_gain(
    model: Model, theta: Theta, run: RememberedRun, scale: Scale, by_tick: Collection[Term] = ()
) -> Floats | float:
    """(M,) or 1: change of the rate per change of the driver, both in units of the driver, which is behind the terms
    `by_tick` already."""
    terms = [each for each in static_terms(model, theta, scale) if each[0].stage in ROTOR and each[0] not in by_tick]
    if not terms:
        return 1.0
    key = ("rotor gain", tuple(each[:2] for each in terms))
    gain: Floats = run.gains(key, lambda: _rotor_gain(terms, theta, run))
    return gain


def thrust_gain(model: Model, theta: Theta, run: RememberedRun, x: Floats, scale: Scale, tare: float) -> Floats | float:
    """(M,) or 1: change of the reading per change of C x|x|, where the rates are `x` (M,)."""
    terms = [each for each in static_terms(model, theta, scale) if each[0].stage not in ROTOR]
    if not terms:
        return 1.0
    key = ("thrust gain", theta.C, tare, tuple(each[:2] for each in terms))
    gain: Floats = run.gains(key, lambda: _thrust_gain(terms, theta, run, x, tare), x)
    return gain


def jumping(
    model: Model, theta: Theta, run: RememberedRun, scale: Scale, samples: Samples, commanded: Floats
) -> Floats | None:
    """(M,) rate at its `samples`, `commanded` (N,), less the line through its means, in units of the driver: of a rotor
    that follows at once. None where no term makes it jump: a slope says it all then, and it says nothing of a jump."""
    terms = [each for each in static_terms(model, theta, scale) if each[0].stage in ROTOR]
    if not any(p.jumps for term, _, sizes in terms for p in term.parameters(sizes)):
        return None
    key = ("jumping", tuple((term, values) for term, values, _ in terms))
    return run.lately(key, lambda: _jumping(terms, theta, run, samples, commanded), commanded)


def _jumping(terms: list[Acting], theta: Theta, run: RememberedRun, samples: Samples, commanded: Floats) -> Floats:
    history = run.history
    still = RememberedRun(replace(history, excess=np.zeros(1)))  # an instant: the command does not move in it
    line, seen = history.driver, commanded
    for term, values, sizes in terms:
        line = term.apply(line, TermContext(run, sizes, theta.C, 0.0, line), values)
        seen = term.apply(seen, TermContext(still, sizes, theta.C, 0.0, seen), values)
    beside = samples.means(seen) - reconstructed(line, history.middle, samples.middle)
    return np.where(samples.count > 0, beside, 0.0)


def static_terms(model: Model, theta: Theta, scale: Scale) -> list[Acting]:
    """Terms that answer a fast change at once, whatever they do later."""
    out = []
    for term, values, sizes in acting(model, theta, scale):
        traits = term.traits
        if traits.dynamics is None and not traits.limits and (traits.delays or not traits.moving) and not term.needs:
            out.append((term, values, sizes))
    return out


def _rotor_gain(terms: list[Acting], theta: Theta, run: RememberedRun) -> Floats:
    driver = run.history.driver
    moved = driver * _alternating(driver.size)
    old, new = driver, moved
    for term, values, sizes in terms:
        old, new = (term.apply(value, TermContext(run, sizes, theta.C, 0.0, value), values) for value in (old, new))
    return _ratio(new - old, *_divisor(moved - driver))


def _thrust_gain(terms: list[Acting], theta: Theta, run: RememberedRun, x: Floats, tare: float) -> Floats:
    """Term by term: a model that has one more than another has what the rest makes of the same change."""
    x_moved, old, new, moves, divisor = run.gains(("moved", theta.C), lambda: _moved(x, theta.C), x)
    key: object = (theta.C, tare)
    for each in terms:
        key = (key, each[:2])
        made = partial(_passed, each, old, new, x, x_moved, theta.C, tare, run)
        old, new = run.gains(("passed", key), made, x)
    return _ratio(new - old, moves, divisor)


def _passed(
    each: Acting, old: Floats, new: Floats, x: Floats, moved: Floats, C: float, tare: float, run: RememberedRun
) -> tuple[Floats, Floats]:
    """What a term makes of a force and of one that a small change was made to."""
    term, values, sizes = each
    return (
        term.apply(old, TermContext(run, sizes, C, tare, x, before=x), values),
        term.apply(new, TermContext(run, sizes, C, tare, moved, before=x), values),
    )


def _moved(x: Floats, C: float) -> tuple[Floats, Floats, Floats, NDArray[np.bool_], Floats]:
    """Rates with a small change, the force of C x|x| before it and after, and the divisor of `_ratio`."""
    moved = x * _alternating(x.size)
    old, new = (C * rate * np.abs(rate) for rate in (x, moved))
    return moved, old, new, *_divisor(new - old)


def _alternating(size: int) -> Floats:
    """Factors of a small change, up and down."""
    out = np.full(size, 1 + SMALL)
    out[1::2] = 1 - SMALL
    return out


def _divisor(change: Floats) -> tuple[NDArray[np.bool_], Floats]:
    """Where anything was moved, but for what rounding leaves; and by how much, 1 elsewhere."""
    size = np.abs(change)
    moves = size > ROUNDING * np.max(size, initial=0.0)
    return moves, np.where(moves, change, 1.0)


def _ratio(new: Floats, moves: NDArray[np.bool_], divisor: Floats) -> Floats:
    """1 where nothing was moved."""
    out: Floats = np.where(moves, new / divisor, 1.0)
    return np.clip(out, 0.0, MOST_GAIN, out=out)
