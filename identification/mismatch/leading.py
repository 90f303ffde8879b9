"""What ticks of the command do at the samples beside the line through means, as the dynamics pass them on."""

from __future__ import annotations

import numpy as np

from identification.mismatch.model import Model, Theta
from identification.physics.filters import resonant
from identification.physics.history import History
from identification.physics.motor_lag import MotorLag, rate_at
from identification.recording import Floats

LONGEST_TICK = 0.2
"""s: what is written more seldom are steps."""


def lead_of(model: Model, theta: Theta, history: History, late: float) -> Floats:
    """(M,) or (1,) driver, for a force that comes `late` s after it and rings: a resonance is a train of delays."""
    rings = [v for t, v in zip(model.terms, theta.terms, strict=True) if t.id == "stand_resonance" and v[0] > 0]
    if not rings or history.ticks is None or history.tick > LONGEST_TICK or history.lead.size == 1:
        return history.lead_after(late)
    later, leads = history.leads_after(late)
    dt = np.full(later.size, later[1])
    s = np.ones(later.size)
    for compliance, frequency, damping in rings:
        s = s + compliance * (resonant(s, dt, frequency, damping) - s)
    weight = np.diff(s, prepend=0.0)
    weight[-1] += 1 - s[-1]
    out: Floats = weight @ leads
    return out


def promptness(model: Model, theta: Theta, tick: float, x: Floats, largest: float) -> Floats | float:
    """How far a tick of the command shows within itself: wholly without a lag, not at all with one of many ticks.

    Where the lag depends on the rate, so does this: (M,).
    """
    lag: Floats | float = 0.0
    for term, values in zip(model.terms, theta.terms, strict=True):
        if isinstance(term, MotorLag) and values[0] > 1e-6:
            lag = lag + 1 / rate_at(term.form, values, x, largest)
    return np.exp(-2 * lag / tick) if np.any(lag) else 1.0
