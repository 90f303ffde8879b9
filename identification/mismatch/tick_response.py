"""What a model says of the rows that the ticks of the command make (physics/tick_rows.py)."""

from __future__ import annotations

import numpy as np

from identification.physics.filters import lowpass, resonant
from identification.physics.motor_lag import MotorLag, rate_at
from identification.physics.term import Scale, Term
from identification.physics.tick_rows import BINS, TickRows
from identification.recording import Floats

FINE = 4
"""Points of a bin at which a model's response is averaged."""
DYNAMIC = ("motor_lag", "stand_resonance", "time_skew")
"""What shows within a few ticks."""
Acting = tuple[Term, tuple[float, ...], Scale]


def held_back(rows: TickRows, acting: list[Acting], shift: float) -> Floats:
    """(B,) 1 - s of the terms that act, s the response to a unit step, averaged over the levels of the ticks.

    Less what the means over intervals have of it: a smooth rise to the last value.
    """
    terms = [each for each in acting if each[0].id in DYNAMIC]
    if not terms and shift == 0:
        return np.zeros(BINS)
    levels = rows.levels if any(term.id == "motor_lag" for term, _, _ in terms) else rows.levels[:1]
    dt = np.full(BINS * FINE, rows.width / FINE)
    after = (np.arange(dt.size) + 0.5) * dt[0]
    mean = np.mean([_later(_response(terms, float(level), dt, after), after, shift) for level in levels], axis=0)
    back = 1 - mean
    # what is not over yet goes on smoothly, and the means have it: without this it would seem to end in a jump
    u = after / (after[-1] + 0.5 * dt[0])
    out: Floats = (back - back[-1] * u**2 * (3 - 2 * u)).reshape(BINS, FINE).mean(axis=1)
    return out


def _response(terms: list[Acting], level: float, dt: Floats, after: Floats) -> Floats:
    s = np.ones(dt.size)
    for term, values, sizes in terms:
        if isinstance(term, MotorLag) and values[0] > 1e-6:
            s = lowpass(s, dt, 1 / rate_at(term.form, values, level, sizes.driver))[1]
        elif term.id == "stand_resonance":
            s = s + values[0] * (resonant(s, dt, values[1], values[2]) - s)
        elif term.id == "time_skew":
            s = _later(s, after, values[0])
    return s


def _later(s: Floats, after: Floats, delay: float) -> Floats:
    if delay == 0:
        return s
    out: Floats = np.interp(after - delay, after, s, left=0.0 if delay > 0 else s[0])
    return out
