"""What a model says of the rows that the ticks of the command make (physics/tick_rows.py)."""

from __future__ import annotations

import numpy as np

from identification.mismatch.model.data import Data
from identification.mismatch.model.model import Acting, Model, acting
from identification.mismatch.model.parameters import Theta
from identification.physics.traits import Dynamics
from identification.recording import Floats
from identification.run_history.filters import lowpass, resonant
from identification.run_history.ticks.step_response_rows import TickRows


def ticked(model: Model, theta: Theta, data: Data) -> list[Floats]:
    """What the model says of the rows of the ticks, run by run."""
    terms = acting(model, theta, data.scale)
    return [told(rows, terms, theta.C, theta.shift) for rows in data.ticks]


def told(rows: TickRows, acting: list[Acting], C: float, shift: float) -> Floats:
    """The rows as a model foretells them."""
    terms = _dynamic(acting)
    late = shift + sum(_acting(each).delay for each in terms)
    return rows.kept((C, *_key(terms, shift)), lambda: rows.predicted(C, held_back(rows, terms, shift), late))


def held_back(rows: TickRows, acting: list[Acting], shift: float) -> Floats:
    """(B,) 1 - s at the nodes: s the response of the acting terms to a unit step, its mean over the levels.

    Less what the means over intervals have of it: a smooth rise to the last value.
    """
    terms = _dynamic(acting)
    if not terms and shift == 0:
        return np.zeros(rows.nodes.size - 1)
    return rows.kept(_key(terms, shift), lambda: _held_back(rows, terms, shift))


def _dynamic(acting: list[Acting]) -> list[Acting]:
    """Those that show within a few ticks."""
    return [each for each in acting if each[0].traits.dynamics is not None]


def _acting(each: Acting) -> Dynamics:
    term, values, sizes = each
    assert term.traits.dynamics is not None
    return term.traits.dynamics(term, values, sizes.driver)


def _key(terms: list[Acting], shift: float) -> tuple[object, ...]:
    return (tuple((term, values, sizes.driver) for term, values, sizes in terms), shift)


def _held_back(rows: TickRows, terms: list[Acting], shift: float) -> Floats:
    known = [_acting(each) for each in terms]
    levels = rows.levels if any(each.rotor is not None for each in known) else rows.levels[:1]
    after = rows.after
    dt = np.full(after.size, 2 * after[0])
    back = 1 - np.mean([_later(_response(known, level, dt, after), after, shift) for level in levels], axis=0)
    # what is not over yet goes on smoothly, and the means have it: without this it would seem to end in a jump
    u = after / rows.nodes[-1]
    out: Floats = rows.hats @ (back - back[-1] * u**2 * (3 - 2 * u))
    return out


def _response(known: list[Dynamics], level: float, dt: Floats, after: Floats) -> Floats:
    s = np.ones(dt.size)
    for each in known:
        if each.rotor is not None:
            quadratic, linear, _ = each.rotor
            s = lowpass(s, dt, 1 / max(2 * quadratic * abs(level) + linear, each.slowest))[1]
        elif each.ring is not None:
            compliance, frequency, damping = each.ring
            s = s + compliance * (resonant(s, dt, frequency, damping) - s)
        elif each.delay:
            s = _later(s, after, each.delay)
    return s


def _later(s: Floats, after: Floats, delay: float) -> Floats:
    if delay == 0:
        return s
    out: Floats = np.interp(after - delay, after, s, left=0.0 if delay > 0 else s[0])
    return out
