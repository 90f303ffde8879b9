"""What ticks of the command do at the samples beside the line through means, as a model's dynamics pass them on."""

from __future__ import annotations

from typing import Literal

import numpy as np

from identification.mismatch.model import Model, Theta, remember
from identification.physics.command_saturation import CommandSaturation, passed
from identification.physics.filters import reconstructed, within_intervals
from identification.physics.history import LARGEST_LEAD, History, Samples
from identification.physics.motor_lag import MotorLag, torques
from identification.physics.ticks_passed import Passed
from identification.recording import Floats

LONGEST_TICK = 0.2
"""s: what is written more seldom are steps."""
LEAST_DELAY = 0.02
"""Of a tick: a shorter delay leaves what the driver does within its ticks where it was."""


def delay_of(model: Model, theta: Theta) -> float:
    """Time in s by which the force comes after the driver."""
    return sum(v[0] for t, v in zip(model.terms, theta.terms, strict=True) if t.id == "time_skew")


def thrust_lead(model: Model, theta: Theta, history: History, largest: float, late: float) -> Floats:
    """(M,) or (1,) driver, at the thrust samples less the line through means: of a force that comes `late` s after."""
    passed = Passed(_rotor(model, theta, largest), _ring(model, theta), late if _is_late(late, history) else 0.0)
    return _remembered(history, "thrust", passed) if _changes(passed, history) else history.lead


def rate_lead(model: Model, theta: Theta, history: History, largest: float) -> Floats:
    """(M,) or (1,) driver, at the samples of the rate less the line through means: the rotor alone passes ticks on."""
    passed = Passed(_rotor(model, theta, largest))
    return _remembered(history, "rate", passed) if _changes(passed, history) else history.rate_lead


def sample_lead(model: Model, theta: Theta, history: History, largest: float) -> Floats:
    """(N,) or (1,): as `thrust_lead`, at each sample."""
    late = delay_of(model, theta)
    passed = Passed(_rotor(model, theta, largest), _ring(model, theta), late)
    if not _changes(passed, history):
        return history.sample_lead
    line = within_intervals(_means(history, passed), history.edges, history.sample_time)
    return _small(_at(history, passed, history.thrust_samples) - line, history)


def passed_on(model: Model, theta: Theta, history: History) -> Floats | float:
    """(M,) or 1: the share of what the command does within an interval that the drive gives the rotor."""
    for term, values in zip(model.terms, theta.terms, strict=True):
        if isinstance(term, CommandSaturation):
            return passed(history, values[0])
    return 1.0


def _is_late(late: float, history: History) -> bool:
    return abs(late) >= LEAST_DELAY * history.tick


def _changes(passed: Passed, history: History) -> bool:
    """Whether dynamics change what the ticks do."""
    return passed != Passed() and history.ticks is not None and history.tick <= LONGEST_TICK


def _remembered(history: History, channel: Literal["thrust", "rate"], passed: Passed) -> Floats:
    key = (channel, passed)
    known = history.memo.get(key)
    if known is None:
        known = _lead(history, passed, history.thrust_samples if channel == "thrust" else history.rate_samples)
        remember(history, key, known)
    return known


def _lead(history: History, passed: Passed, samples: Samples) -> Floats:
    mean = samples.means(_at(history, passed, samples))
    line = reconstructed(_means(history, passed), history.middle, samples.middle)
    return _small(np.where(samples.count > 0, mean - line, 0.0), history)


def _means(history: History, passed: Passed) -> Floats:
    known = history.memo.get(passed)
    if known is None:
        known = passed.means(history)
        remember(history, passed, known)
    return known


def _at(history: History, passed: Passed, samples: Samples) -> Floats:
    assert history.ticks is not None
    when, value = history.ticks
    return passed.at(*samples.after(when, passed.delay), when, value)


def _small(lead: Floats, history: History) -> Floats:
    out: Floats = np.where(np.abs(lead) < LARGEST_LEAD * history.size, lead, 0.0)
    return out


def _rotor(model: Model, theta: Theta, largest: float) -> tuple[float, float] | None:
    """Coefficients of a rotor that does not follow at once."""
    for term, values in zip(model.terms, theta.terms, strict=True):
        if isinstance(term, MotorLag) and values[0] > 1e-6:
            return torques(term.form, values, largest)
    return None


def _ring(model: Model, theta: Theta) -> tuple[float, float, float] | None:
    for term, values in zip(model.terms, theta.terms, strict=True):
        if term.id == "stand_resonance" and values[0] > 0:
            return values[0], values[1], values[2]
    return None
