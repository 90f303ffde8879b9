"""What ticks of the command do at the samples beside the line through means, as a model's dynamics pass them on.

What a screening or a fit asks for again is kept with the history.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from identification.mismatch.model.model import Model, Theta
from identification.physics.command_saturation import CommandSaturation
from identification.physics.load_cell_saturation import LoadCellSaturation
from identification.physics.motor_lag import MotorLag, torques
from identification.recording import Floats
from identification.run_history.filters import delayed, reconstructed
from identification.run_history.history import History, Samples
from identification.run_history.sub_interval_dynamics import Passed
from identification.run_history.sub_interval_leads import curvature, each_lead, lead

LONGEST_TICK = 0.2
"""s: what is written more seldom are steps."""
LEAST_DELAY = 0.02
"""Of a tick: a shorter delay leaves what the driver does within its ticks where it was."""
Channel = Literal["thrust", "rate"]


def delay_of(model: Model, theta: Theta) -> float:
    """Time in s by which the force comes after the driver."""
    return sum(v[0] for t, v in zip(model.terms, theta.terms, strict=True) if t.id == "time_skew")


def ahead(model: Model, theta: Theta, history: History, x: Floats, largest: float, late: float) -> Floats:
    """(M,) driver |driver|, at the thrust samples less the line through means: of a force at the rates x (M,) that a
    stand may pass on, and that comes `late` s after."""
    passed = Passed(_rotor(model, theta, largest), _ring(model, theta), late if _is_late(late, history) else 0.0)
    share = passed_on(model, theta, history)
    if not _changes(passed, history):
        return history.lately("ahead", lambda: share * (2 * np.abs(x) * history.lead + history.curved), x, share)
    known = _remembered(history, "thrust", passed)
    if passed.ring is not None:
        return np.asarray(share * known[0], dtype=np.float64)
    return history.lately("ahead", lambda: share * (2 * np.abs(x) * known[0] + known[1]), x, known, share)


def turning(model: Model, theta: Theta, history: History, x: Floats, largest: float, late: float) -> Floats:
    """(M,) rate at its samples, in units of the driver, of a rotor whose mean rates are `x` (M,), read `late` s after;
    the rotor alone passes ticks on."""
    passed = Passed(_rotor(model, theta, largest), delay=late if _is_late(late, history) else 0.0)
    known = _remembered(history, "rate", passed) if _changes(passed, history) else history.rate_lead
    share, shift = passed_on(model, theta, history), theta.rate_shift

    def made() -> Floats:
        assert history.rate_sampled is not None
        moved = delayed(x, history.edges, shift) if shift else x
        line = reconstructed(moved, history.middle, history.rate_sampled)
        return np.asarray(line + share * np.atleast_2d(known)[0], dtype=np.float64)

    return history.lately(("turning", shift), made, x, known, share)


def sample_lead(model: Model, theta: Theta, history: History, rate: Floats, largest: float) -> Floats:
    """(N,) driver |driver|: as `ahead`, at each sample, where the rates are `rate` (N,)."""
    passed = Passed(_rotor(model, theta, largest), _ring(model, theta), delay_of(model, theta) + theta.shift)
    if not _changes(passed, history):
        return 2 * np.abs(rate) * history.sample_lead
    assert history.ticks is not None
    when, value = history.ticks
    answer = passed.at if passed.ring is None else passed.rung_at
    seen = answer(*history.thrust_samples.after(when, passed.delay), when, value)
    beside = each_lead(history, seen, _means(history, passed), _size(history, passed))
    return beside if passed.ring is not None else 2 * np.abs(rate) * beside


def passed_on(model: Model, theta: Theta, history: History) -> Floats | float:
    """(M,) or 1: the share of what the command does within an interval that the drive gives the rotor."""
    for term, values in zip(model.terms, theta.terms, strict=True):
        if isinstance(term, CommandSaturation):
            return term.passed(history, values)
    return 1.0


def shown(model: Model, theta: Theta, history: History, F: Floats, x: Floats, tare: float) -> Floats | float:
    """(M,) or 1: the share of what the force F (without tare) does within an interval that the cell shows."""
    for term, values in zip(model.terms, theta.terms, strict=True):
        if isinstance(term, LoadCellSaturation):
            return term.shown(history, theta.C, x, F + tare, values)
    return 1.0


def _is_late(late: float, history: History) -> bool:
    return abs(late) >= LEAST_DELAY * history.tick


def _changes(passed: Passed, history: History) -> bool:
    """Whether dynamics change what the ticks do."""
    return passed != Passed() and history.ticks is not None and history.tick <= LONGEST_TICK


def _remembered(history: History, channel: Channel, passed: Passed) -> Floats:
    """(2, M) `lead` and `curvature` of a channel; of a stand that rings the lead of the force."""
    return history.leads((channel, passed), lambda: _leads(history, channel, passed))


def _leads(history: History, channel: Channel, passed: Passed) -> Floats:
    samples, means, size = _samples(history, channel), _means(history, passed), _size(history, passed)
    seen, force = _followed(history, channel, replace(passed, ring=None))
    if passed.ring is None:
        beside = lead(history, seen, means, samples, size)
        return np.array([beside, curvature(history, force, means, beside, samples)])
    assert history.ticks is not None
    when, value = history.ticks
    rung = force + samples.means(passed.ringing(*samples.after(when, passed.delay), when, value))
    beside = lead(history, rung, means, samples, size)
    return np.array([beside, np.zeros(beside.size)])


def _followed(history: History, channel: Channel, passed: Passed) -> Floats:
    """(2, M) means at the samples of rate and rate |rate|: a stand that rings in any way has the same rotor."""
    samples = _samples(history, channel)

    def made() -> Floats:
        assert history.ticks is not None
        when, value = history.ticks
        rate = passed.followed(*samples.after(when, passed.delay), value, _rates(history, passed))
        return np.array([samples.means(rate), samples.means(rate * np.abs(rate))])

    return history.lately((channel, passed), made)


def _rates(history: History, passed: Passed) -> Floats:
    """(T,) of the rotor at the ticks, sought from the last one: it is seldom far."""
    assert history.ticks is not None
    when, value = history.ticks

    def made() -> Floats:
        found = passed.rates(when, value, history.memo.get("rates"))
        history.memo["rates"] = found
        return found

    return history.lately(("rates", passed.rotor), made)


def _samples(history: History, channel: Channel) -> Samples:
    return history.thrust_samples if channel == "thrust" else history.rate_samples


def _means(history: History, passed: Passed) -> Floats:
    made = passed.means if passed.ring is None else passed.rung_means
    return history.leads(passed, lambda: made(history))


def _size(history: History, passed: Passed) -> float:
    """Of the driver, or what a relative change of it changes of driver |driver|."""
    return history.size if passed.ring is None else 2 * history.size**2


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
