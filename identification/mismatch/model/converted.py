"""What ticks of the command do in samples that are no instants, beside what a converter makes of interval means.

A ramp is a staircase whose steps are as long as a window and a low pass: a window as long as the step takes it away,
another one leaves what beats with the samples, and looks like a line in the spectrum or a late step.
"""

from __future__ import annotations

import numpy as np

from identification.mismatch.model.behind_drive import behind_drive
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.static_gain import rotor_gain, thrust_gain
from identification.mismatch.model.sub_interval import delay_of, dynamics_between, passed_on
from identification.physics.term import Scale
from identification.recording import Floats
from identification.run_history.converter import Converter, Mode
from identification.run_history.filters import within_intervals
from identification.run_history.remembered import RememberedRun
from identification.run_history.ticks.sub_interval_dynamics import Passed, with_knots


def beside_means(
    model: Model, theta: Theta, run: RememberedRun, x: Floats, scale: Scale, late: float, tare: float
) -> Floats:
    """(M,) driver |driver| in the samples of each interval less what is in its means, of a force at the rates x (M,)
    that comes `late` s after."""
    history = run.history
    passed = dynamics_between(model, theta, history, scale.driver, late)
    behind, by_tick = behind_drive(model, theta, run, scale)
    known = behind.leads(("converted", passed), lambda: _beside_means(behind, passed))
    gain = rotor_gain(model, theta, behind, scale, by_tick) * thrust_gain(model, theta, run, x, scale, tare)
    return np.asarray(passed_on(model, theta, history, by_tick) * gain * known, dtype=np.float64)


def converted_samples(model: Model, theta: Theta, run: RememberedRun, F: Floats, largest: float) -> Floats:
    """(N,) N, each sample of a force whose means over intervals are F (M,)."""
    history = run.history
    at = within_intervals(run.converted_amid(F), history.edges, history.sample_time)
    if history.ticks is None:
        return at
    passed = dynamics_between(model, theta, history, largest, delay_of(model, theta) + theta.shift)
    line = within_intervals(run.converted_amid(passed.force_means(run)), history.edges, history.sample_time)
    return at + theta.C * (_each(run, passed) - line)


def _beside_means(run: RememberedRun, passed: Passed) -> Floats:
    samples = run.samples("thrust")
    beside = samples.means(_each(run, passed)) - run.converted(passed.force_means(run))
    return np.where(samples.count > 0, beside, 0.0)


def _each(run: RememberedRun, passed: Passed) -> Floats:
    """(N,) rate |rate| as the converter shows it in each sample."""
    history, at = run.history, run.samples("thrust").time - passed.delay
    assert history.ticks is not None
    if passed.rotor is None and passed.ring is None:
        when, value = history.ticks
        return _shown(history.converter, at, when, value * np.abs(value))
    when, value = passed.knots(*with_knots(history.ticks, history.edges - passed.delay))
    steady, modes = passed.rotor_modes(when, value)
    ring = passed.ring_modes(when, value) if passed.ring is not None else ()
    return _shown(history.converter, at, when, steady, (*modes, *ring))


def _shown(converter: Converter, at: Floats, when: Floats, value: Floats, modes: tuple[Mode, ...] = ()) -> Floats:
    """(N,) samples at `at` of what takes `value` (T,) at `when` (T,), and the last of them for good."""
    knots = np.append(when, when[-1] + 1.0)
    return converter.shown(value, np.diff(knots), converter.places(knots, at), modes)
