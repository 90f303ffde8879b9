"""What ticks of the command do at the samples beside the line through means, as a model's dynamics pass them on.

What a screening or a fit asks for again is remembered with the run.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from functools import partial
from typing import cast

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.model.behind_drive import behind_drive
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.static_gain import jumping, rotor_gain, thrust_gain
from identification.physics.term import Scale, Term
from identification.physics.traits import Dynamics, LimitsCommand, LimitsReading
from identification.recording import Floats
from identification.run_history.converter import Mode
from identification.run_history.filters import reconstructed
from identification.run_history.history import History
from identification.run_history.remembered import Channel, RememberedRun
from identification.run_history.rotor_lag import Rotor
from identification.run_history.ticks.sub_interval_dynamics import Passed, lasts
from identification.run_history.ticks.sub_interval_leads import each_lead, lead, lead_and_curvature


def dynamics_between(model: Model, theta: Theta, history: History, largest: float, late: float) -> Passed:
    """What a model has between the driver and a force that comes `late` s after, as far as its ticks show it."""
    delay = late if _is_late(late, history) else 0.0
    passed = Passed(rotor_of(model, theta, largest), _ring(model, theta), delay)
    return passed if _changes(passed, history) else Passed(delay=delay)


def delay_of(model: Model, theta: Theta) -> float:
    """Time in s by which the force comes after the driver."""
    return sum(each.delay for each in _dynamics(model, theta, 1.0))


def ahead(model: Model, theta: Theta, run: RememberedRun, x: Floats, scale: Scale, late: float, tare: float) -> Floats:
    """(M,) driver |driver|, at the thrust samples less the line through means: of a force at the rates x (M,) that a
    stand may pass on, and that comes `late` s after."""
    behind, by_tick = behind_drive(model, theta, run, scale)
    beside = _ahead(model, theta, behind, x, scale.driver, late, by_tick)
    if run.history.ticks is None:
        return beside
    gain = rotor_gain(model, theta, behind, scale, by_tick) * thrust_gain(model, theta, run, x, scale, tare)
    return gain * beside


def _ahead(
    model: Model, theta: Theta, run: RememberedRun, x: Floats, largest: float, late: float, by_tick: Collection[Term]
) -> Floats:
    history = run.history
    passed = Passed(rotor_of(model, theta, largest), _ring(model, theta), late if _is_late(late, history) else 0.0)
    share = passed_on(model, theta, history, by_tick)
    if not _changes(passed, history):
        return run.lately("ahead", lambda: share * (2 * np.abs(x) * history.lead + history.curved), x, share)
    known = _remembered(run, passed)
    if passed.ring is not None:
        return np.asarray(share * known[0], dtype=np.float64)
    then = run.delayed(x, passed.delay) if passed.delay else x
    return run.lately("ahead", lambda: share * (2 * np.abs(then) * known[0] + known[1]), then, known, share)


def turning(model: Model, theta: Theta, run: RememberedRun, x: Floats, scale: Scale, late: float) -> Floats:
    """(M,) rate at its samples, in units of the driver, of a rotor whose mean rates are `x` (M,), read `late` s after;
    the rotor alone passes ticks on. A rate is read so well that a rotor on its way between two steps, however far they
    are apart, is bent within an interval."""
    run, by_tick = behind_drive(model, theta, run, scale)
    history = run.history
    passed = Passed(rotor_of(model, theta, scale.driver), delay=late if _is_late(late, history) else 0.0)
    bent = passed.rotor is not None and history.ticks is not None
    known = _rate_lead(run, passed) if bent or _changes(passed, history) else history.rate_lead
    share, shift = passed_on(model, theta, history, by_tick), theta.rate_shift
    gain = 1.0 if history.ticks is None else rotor_gain(model, theta, run, scale, by_tick)
    jumped = None if passed.rotor is not None or by_tick else _jumped(model, theta, run, scale, passed.delay)

    def made() -> Floats:
        assert history.rate_sampled is not None
        moved = run.delayed(x, shift) if shift else x
        line = reconstructed(moved, history.middle, history.rate_sampled)
        beside = gain * known if jumped is None else np.where(known != 0, jumped, 0.0)
        return np.asarray(line + share * beside, dtype=np.float64)

    return run.lately(("turning", shift), made, x, known, share, gain, jumped)


def _jumped(model: Model, theta: Theta, run: RememberedRun, scale: Scale, delay: float) -> Floats | None:
    """(M,) rate at its samples less the line through its means, where a tick may make a rotor jump."""
    if run.history.ticks is None:
        return None
    value = run.history.ticks[1]
    commanded = run.lately(("commanded", delay), lambda: value[run.after_ticks("rate", delay)[0]])
    return jumping(model, theta, run, scale, run.samples("rate"), commanded)


def sample_lead(model: Model, theta: Theta, run: RememberedRun, rate: Floats, largest: float) -> Floats:
    """(N,) driver |driver|: as `ahead`, at each sample, where the rates are `rate` (N,)."""
    history = run.history
    if history.ticks is None:
        return 2 * np.abs(rate) * history.sample_lead
    passed = Passed(rotor_of(model, theta, largest), _ring(model, theta), delay_of(model, theta) + theta.shift)
    passed = passed if _changes(passed, history) else Passed()
    last, since = run.after_ticks("thrust", passed.delay)
    seen = passed.followed(last, since, history.ticks[1], run.rates_at_ticks(passed.rotor))
    if passed.ring is not None:
        seen = seen * np.abs(seen)
        when, modes = _ring_modes(run, passed)
        last, since = history.thrust_samples.after(when, passed.delay)
        seen += sum(mode.at(since, last) for mode in modes)
    beside = each_lead(history, seen, _means(run, passed), _size(history, passed))
    return beside if passed.ring is not None else 2 * np.abs(rate) * beside


def passed_on(model: Model, theta: Theta, history: History, by_tick: Collection[Term] = ()) -> Floats | float:
    """(M,) or 1: the share of what the command does within an interval that the drive gives the rotor, where it is not
    behind its limit already."""
    share: Floats | float = 1.0
    for term, values, _ in _every(model, theta, 1.0):
        if term.traits.limits == "command" and term not in by_tick:
            share = share * cast(LimitsCommand, term).passed(history, values)
    return share


def shown(model: Model, theta: Theta, history: History, F: Floats, x: Floats, tare: float) -> Floats | float:
    """(M,) or 1: the share of what the force F (without tare) does within an interval that the cell shows."""
    share: Floats | float = 1.0
    for term, values, _ in _every(model, theta, 1.0):
        if term.traits.limits == "reading":
            share = share * cast(LimitsReading, term).shown(history, theta.C, x, F + tare, values)
    return share


def _is_late(late: float, history: History) -> bool:
    return abs(late) >= policy.estimate.TICK_DELAY * history.tick


def _changes(passed: Passed, history: History) -> bool:
    """Whether dynamics change what the ticks do."""
    return passed != Passed() and history.ticks is not None and history.tick <= policy.estimate.TICK_INTERVAL


def _remembered(run: RememberedRun, passed: Passed) -> Floats:
    """(2, M) `lead_and_curvature` of the thrust; of a stand that rings the lead of the force, and nothing."""
    return run.leads(("thrust", passed), lambda: _leads(run, passed))


def _leads(run: RememberedRun, passed: Passed) -> Floats:
    history = run.history
    samples, means, size = history.thrust_samples, _means(run, passed), _size(history, passed)
    seen, force = _followed(run, "thrust", replace(passed, ring=None))
    if passed.ring is None:
        return lead_and_curvature(history, (seen, force), (means, passed.force_means(run)), samples, size)
    when, modes = _ring_modes(run, passed)
    rung = [samples.means_after(when, passed.delay, lasts(mode), partial(_of_mode, mode)) for mode in modes]
    beside = lead(history, force + np.sum(rung, axis=(0, 1)), means, samples, size)
    return np.array([beside, np.zeros(beside.size)])


def _rate_lead(run: RememberedRun, passed: Passed) -> Floats:
    """(M,) `lead` of the rate."""

    def made() -> Floats:
        (seen,) = _followed(run, "rate", passed)
        history = run.history
        return lead(history, seen, _means(run, passed), history.rate_samples, _size(history, passed))

    return run.leads(("rate", passed), made)


def _ring_modes(run: RememberedRun, passed: Passed) -> tuple[Floats, tuple[Mode, ...]]:
    """(T,) s and what the stand adds to rate |rate| from then on."""
    ticks = run.history.ticks
    assert ticks is not None
    when, value = run.knots(passed.rotor, lambda: passed.knots(*ticks))
    return when, passed.ring_modes(when, value)


def _of_mode(mode: Mode, last: NDArray[np.intp], since: Floats) -> Floats:
    return mode.at(since, last)[np.newaxis]


def _followed(run: RememberedRun, channel: Channel, passed: Passed) -> Floats:
    """(2, M) means at the samples of rate and rate |rate|, of the rate's channel (1, M) the first alone: a stand that
    rings in any way has the same rotor."""
    samples, squared = run.samples(channel), channel == "thrust"

    def made() -> Floats:
        assert run.history.ticks is not None
        when, value = run.history.ticks
        rates = _rates(run, passed)

        def beside(last: NDArray[np.intp], since: Floats) -> Floats:
            held, rate = value[last], passed.followed(last, since, value, rates)
            return _told(rate, squared) - _told(held, squared)

        held = np.array([samples.held_means(when, passed.delay, each) for each in _told(value, squared)])
        return held + samples.means_after(when, passed.delay, passed.unsettled(value), beside, held.shape[0])

    return run.lately((channel, passed), made)


def _told(rate: Floats, squared: bool) -> Floats:
    """(2, k) rate and rate |rate|, or (1, k) the first alone."""
    return np.array([rate, rate * np.abs(rate)] if squared else [rate])


def _rates(run: RememberedRun, passed: Passed) -> Floats:
    """(T,) of the rotor at the ticks."""
    return run.lately(("rates", passed.rotor), lambda: run.rates_at_ticks(passed.rotor))


def _means(run: RememberedRun, passed: Passed) -> Floats:
    made = passed.means if passed.ring is None else passed.rung_means
    return run.leads(passed, lambda: made(run))


def _size(history: History, passed: Passed) -> float:
    """Of the driver, or what a relative change of it changes of driver |driver|."""
    return history.size if passed.ring is None else 2 * history.size**2


def rotor_of(model: Model, theta: Theta, largest: float) -> Rotor | None:
    """Coefficients of a rotor that does not follow at once; two lags one behind the other as one of both times."""
    rotors = [each.rotor for each in _dynamics(model, theta, largest) if each.rotor is not None]
    if len(rotors) < 2:
        return rotors[0] if rotors else None
    rates = [2 * each.quadratic * largest + each.linear for each in rotors]
    slowest = int(np.argmin(rates))
    share = 1 / (rates[slowest] * sum(1 / rate for rate in rates))
    quadratic, linear, released = rotors[slowest]
    return Rotor(share * quadratic, share * linear, released)


def _ring(model: Model, theta: Theta) -> tuple[float, float, float] | None:
    rings = (each.ring for each in _dynamics(model, theta, 1.0))
    return next((ring for ring in rings if ring is not None and ring[0] > 0), None)


def _dynamics(model: Model, theta: Theta, largest: float) -> list[Dynamics]:
    """Of the terms that have such."""
    every = _every(model, theta, largest)
    return [term.traits.dynamics(term, values, at) for term, values, at in every if term.traits.dynamics is not None]


def _every(model: Model, theta: Theta, largest: float) -> list[tuple[Term, tuple[float, ...], float]]:
    """Terms given and found, with the driver that their values refer to."""
    given = [(each.term, each.values, each.scale.driver) for each in model.held]
    found = zip(model.terms, theta.terms, strict=True)
    return [*given, *((term, values, largest) for term, values in found)]
