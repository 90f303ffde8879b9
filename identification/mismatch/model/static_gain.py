"""How much of a fast change a model's static terms pass on: what ticks do within an interval goes through them too.

Asked by a small change that alternates from interval to interval: what has a memory has not followed it yet.
Dynamics of a few ticks (a lag, a ring, a delay) and limits have answers of their own (sub_interval.py).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.mismatch.model.model import Model, acting
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

Acting = list[tuple[Term, tuple[float, ...], Scale]]


def rotor_gain(model: Model, theta: Theta, run: RememberedRun, scale: Scale) -> Floats | float:
    """(M,) or 1: change of the rate per change of the driver, both in units of the driver."""
    terms = [each for each in _static(model, theta, scale) if each[0].stage in ROTOR]
    if not terms:
        return 1.0
    key = ("rotor gain", tuple((term, values) for term, values, _ in terms))
    return run.lately(key, lambda: _rotor_gain(terms, theta, run))


def thrust_gain(model: Model, theta: Theta, run: RememberedRun, x: Floats, scale: Scale, tare: float) -> Floats | float:
    """(M,) or 1: change of the reading per change of C x|x|, where the rates are `x` (M,)."""
    terms = [each for each in _static(model, theta, scale) if each[0].stage not in ROTOR]
    if not terms:
        return 1.0
    key = ("thrust gain", theta.C, tare, tuple((term, values) for term, values, _ in terms))
    return run.lately(key, lambda: _thrust_gain(terms, theta, run, x, tare), x)


def jumping(
    model: Model, theta: Theta, run: RememberedRun, scale: Scale, samples: Samples, commanded: Floats
) -> Floats | None:
    """(M,) rate at its `samples`, `commanded` (N,), less the line through its means, in units of the driver: of a rotor
    that follows at once. None where no term makes it jump: a slope says it all then, and it says nothing of a jump."""
    terms = [each for each in _static(model, theta, scale) if each[0].stage in ROTOR]
    if not any(p.jumps for term, _, sizes in terms for p in term.parameters(sizes)):
        return None
    key = ("jumping", tuple((term, values) for term, values, _ in terms))
    return run.lately(key, lambda: _jumping(terms, theta, run, samples, commanded), commanded)


def _jumping(terms: Acting, theta: Theta, run: RememberedRun, samples: Samples, commanded: Floats) -> Floats:
    history = run.history
    still = RememberedRun(replace(history, excess=np.zeros(1)))  # an instant: the command does not move in it
    line, seen = history.driver, commanded
    for term, values, sizes in terms:
        line = term.apply(line, TermContext(run, sizes, theta.C, 0.0, line), values)
        seen = term.apply(seen, TermContext(still, sizes, theta.C, 0.0, seen), values)
    beside = samples.means(seen) - reconstructed(line, history.middle, samples.middle)
    return np.where(samples.count > 0, beside, 0.0)


def _static(model: Model, theta: Theta, scale: Scale) -> Acting:
    """Terms that answer a fast change at once, whatever they do later."""
    out = []
    for term, values, sizes in acting(model, theta, scale):
        traits = term.traits
        if traits.dynamics is None and not traits.limits and (traits.delays or not traits.moving) and not term.needs:
            out.append((term, values, sizes))
    return out


def _rotor_gain(terms: Acting, theta: Theta, run: RememberedRun) -> Floats:
    driver = run.history.driver
    moved = driver * _alternating(driver.size)
    old, new = driver, moved
    for term, values, sizes in terms:
        old, new = (term.apply(value, TermContext(run, sizes, theta.C, 0.0, value), values) for value in (old, new))
    return _ratio(new - old, moved - driver)


def _thrust_gain(terms: Acting, theta: Theta, run: RememberedRun, x: Floats, tare: float) -> Floats:
    moved = x * _alternating(x.size)
    old, new = (theta.C * rate * np.abs(rate) for rate in (x, moved))
    change = new - old
    for term, values, sizes in terms:
        old, new = (
            term.apply(force, TermContext(run, sizes, theta.C, tare, rate, before=x), values)
            for force, rate in ((old, x), (new, moved))
        )
    return _ratio(new - old, change)


def _alternating(size: int) -> Floats:
    """Factors of a small change, up and down."""
    out = np.full(size, 1 + SMALL)
    out[1::2] = 1 - SMALL
    return out


def _ratio(new: Floats, old: Floats) -> Floats:
    """1 where nothing was moved, but for what rounding leaves."""
    moved = np.abs(old) > ROUNDING * np.max(np.abs(old), initial=0.0)
    out: Floats = np.where(moved, new / np.where(moved, old, 1.0), 1.0)
    return np.clip(out, 0.0, MOST_GAIN)
