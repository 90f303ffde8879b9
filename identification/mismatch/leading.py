"""What ticks of the command do at the samples beside the line through means, as a model's dynamics pass them on."""

from __future__ import annotations

from typing import Literal

from identification.mismatch.model import Model, Theta, remember
from identification.physics.command_saturation import CommandSaturation, passed
from identification.physics.history import History
from identification.physics.load_cell_saturation import LoadCellSaturation, below, half_moved
from identification.physics.motor_lag import MotorLag, torques
from identification.physics.tick_leads import at_samples, each_lead, leads
from identification.physics.ticks_passed import Passed
from identification.recording import Floats

LONGEST_TICK = 0.2
"""s: what is written more seldom are steps."""
LEAST_DELAY = 0.02
"""Of a tick: a shorter delay leaves what the driver does within its ticks where it was."""


def delay_of(model: Model, theta: Theta) -> float:
    """Time in s by which the force comes after the driver."""
    return sum(v[0] for t, v in zip(model.terms, theta.terms, strict=True) if t.id == "time_skew")


def thrust_lead(model: Model, theta: Theta, history: History, largest: float, late: float) -> tuple[Floats, Floats]:
    """(M,) or (1,) each, of a force that comes `late` s after: driver at the thrust samples less the line through
    means, and driver |driver| there less what line and lead make of it."""
    passed = Passed(_rotor(model, theta, largest), _ring(model, theta), late if _is_late(late, history) else 0.0)
    if not _changes(passed, history):
        return history.lead, history.curved
    lead, curved = _remembered(history, "thrust", passed)
    return lead, curved


def rate_lead(model: Model, theta: Theta, history: History, largest: float, late: float) -> Floats:
    """(M,) or (1,) driver, at the samples of a rate `late` s behind less the line through means: the rotor alone passes
    ticks on."""
    passed = Passed(_rotor(model, theta, largest), delay=late if _is_late(late, history) else 0.0)
    if not _changes(passed, history):
        return history.rate_lead
    lead: Floats = _remembered(history, "rate", passed)[0]
    return lead


def sample_lead(model: Model, theta: Theta, history: History, largest: float) -> Floats:
    """(N,) or (1,): the lead of `thrust_lead`, at each sample."""
    passed = Passed(_rotor(model, theta, largest), _ring(model, theta), delay_of(model, theta) + theta.shift)
    if not _changes(passed, history):
        return history.sample_lead
    samples = history.thrust_samples
    return each_lead(history, at_samples(history, passed, samples), _means(history, passed), samples)


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
    """(2, M) `leads` of a channel."""
    key = (channel, passed)
    known = history.memo.get(key)
    if known is None:
        samples = history.thrust_samples if channel == "thrust" else history.rate_samples
        known = leads(history, at_samples(history, passed, samples), _means(history, passed), samples)
        remember(history, key, known)
    return known


def _means(history: History, passed: Passed) -> Floats:
    known = history.memo.get(passed)
    if known is None:
        known = passed.means(history)
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
