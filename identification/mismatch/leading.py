"""What ticks of the command do at the samples beside the line through means, as a model's dynamics pass them on."""

from __future__ import annotations

from typing import Literal

import numpy as np

from identification.mismatch.model import Model, Theta, remember
from identification.physics.command_saturation import CommandSaturation, passed
from identification.physics.history import History, Samples
from identification.physics.load_cell_saturation import LoadCellSaturation, below, half_moved
from identification.physics.motor_lag import MotorLag, torques
from identification.physics.tick_leads import at_samples, curvature, each_lead, lead
from identification.physics.ticks_passed import Passed
from identification.recording import Floats

LONGEST_TICK = 0.2
"""s: what is written more seldom are steps."""
LEAST_DELAY = 0.02
"""Of a tick: a shorter delay leaves what the driver does within its ticks where it was."""


def delay_of(model: Model, theta: Theta) -> float:
    """Time in s by which the force comes after the driver."""
    return sum(v[0] for t, v in zip(model.terms, theta.terms, strict=True) if t.id == "time_skew")


def force_lead(model: Model, theta: Theta, history: History, x: Floats, largest: float, late: float) -> Floats:
    """(M,) driver |driver|, at the thrust samples less the line through means: of a force at the rates x (M,) that a
    stand may pass on, and that comes `late` s after."""
    passed = Passed(_rotor(model, theta, largest), _ring(model, theta), late if _is_late(late, history) else 0.0)
    if not _changes(passed, history):
        return 2 * np.abs(x) * history.lead + history.curved
    beside, curved = _remembered(history, "thrust", passed)
    force: Floats = beside if passed.ring is not None else 2 * np.abs(x) * beside + curved
    return force


def rate_lead(model: Model, theta: Theta, history: History, largest: float, late: float) -> Floats:
    """(M,) or (1,) driver, at the samples of a rate `late` s behind less the line through means: the rotor alone passes
    ticks on."""
    passed = Passed(_rotor(model, theta, largest), delay=late if _is_late(late, history) else 0.0)
    if not _changes(passed, history):
        return history.rate_lead
    beside: Floats = _remembered(history, "rate", passed)[0]
    return beside


def sample_lead(model: Model, theta: Theta, history: History, rate: Floats, largest: float) -> Floats:
    """(N,) driver |driver|: as `force_lead`, at each sample, where the rates are `rate` (N,)."""
    passed = Passed(_rotor(model, theta, largest), _ring(model, theta), delay_of(model, theta) + theta.shift)
    if not _changes(passed, history):
        return 2 * np.abs(rate) * history.sample_lead
    samples = history.thrust_samples
    value = at_samples(history, passed, samples)
    beside = each_lead(history, passed, value, _means(history, passed), samples)
    return beside if passed.ring is not None else 2 * np.abs(rate) * beside


def passed_on(model: Model, theta: Theta, history: History) -> Floats | float:
    """(M,) or 1: the share of what the command does within an interval that the drive gives the rotor."""
    for term, values in zip(model.terms, theta.terms, strict=True):
        if isinstance(term, CommandSaturation):
            return passed(history, values[0])
    return 1.0


def shown(model: Model, theta: Theta, history: History, F: Floats, x: Floats, tare: float) -> Floats | float:
    """(M,) or 1: the share of what the force F (without tare) does within an interval that the cell shows."""
    for term, values in zip(model.terms, theta.terms, strict=True):
        if isinstance(term, LoadCellSaturation):
            return below(F + tare, values[0], half_moved(history, theta.C, x))
    return 1.0


def _is_late(late: float, history: History) -> bool:
    return abs(late) >= LEAST_DELAY * history.tick


def _changes(passed: Passed, history: History) -> bool:
    """Whether dynamics change what the ticks do."""
    return passed != Passed() and history.ticks is not None and history.tick <= LONGEST_TICK


def _remembered(history: History, channel: Literal["thrust", "rate"], passed: Passed) -> Floats:
    """(2, M) `lead` of a channel, and of a rate its `curvature`."""
    key = (channel, passed)
    known = history.memo.get(key)
    if known is None:
        known = _lead(history, passed, history.thrust_samples if channel == "thrust" else history.rate_samples)
        remember(history, key, known)
    return known


def _lead(history: History, passed: Passed, samples: Samples) -> Floats:
    value, means = at_samples(history, passed, samples), _means(history, passed)
    beside = lead(history, passed, value, means, samples)
    rings = passed.ring is not None
    return np.array([beside, 0 * beside if rings else curvature(history, value, means, beside, samples)])


def _means(history: History, passed: Passed) -> Floats:
    known = history.memo.get(passed)
    if known is None:
        known = passed.means(history) if passed.ring is None else passed.rung_means(history)
        remember(history, passed, known)
    return known


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
