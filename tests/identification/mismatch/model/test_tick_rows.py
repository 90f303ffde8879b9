"""Ticks of a ramp measure the response to a step between the samples: forces by closed forms, not by our filters."""

import numpy as np
import pytest

from identification.mismatch.model.step_response import told
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.prepare.scales import scale_of
from identification.physics.motor_lag import MotorLag
from identification.physics.stand_resonance import StandResonance
from identification.physics.time_skew import TimeSkew
from identification.recording import Channel, Recording
from identification.run_history.remembered import RememberedRun
from identification.run_history.ticks.step_response_rows import tick_rows

C = 0.5
TICK = 0.05
"""s between writes of the command."""
RATE = 313.0
"""Hz, out of step with the ticks."""
SECONDS = 60.0


def at_once(t):
    return (t >= 0).astype(float)


def lagging(tau):
    return lambda t: np.where(t >= 0, 1 - np.exp(-np.maximum(t, 0) / tau), 0.0)


def late(delay):
    return lambda t: (t >= delay).astype(float)


def ringing(f, damping):
    w = 2 * np.pi * f
    wd = w * np.sqrt(1 - damping**2)

    def s(t):
        t = np.maximum(t, 0)
        return 1 - np.exp(-damping * w * t) * (np.cos(wd * t) + damping * w / wd * np.sin(wd * t))

    return s


def ramped(response, noise=0.02, seed=0):
    """A recording of slow ramps up and down: each tick is a step of the force, answered by `response`."""
    at = np.arange(0.0, SECONDS, TICK) + 0.0031
    volts = 2.0 + 8.0 * np.abs((at / 10.0) % 2 - 1)
    t = np.arange(0.0, SECONDS, 1 / RATE)
    change = np.diff(C * volts * np.abs(volts), prepend=0.0)
    force = np.zeros(t.size)
    for a, size in zip(at, change, strict=True):
        begin = np.searchsorted(t, a)
        end = np.searchsorted(t, a + 2.0)
        force[begin:end] += size * response(t[begin:end] - a)
        force[end:] += size
    force += noise * np.random.default_rng(seed).standard_normal(t.size)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", at, volts),
        Channel("thrust", "cell", "thrust", "N", t, force),
    )
    return history_of(Recording("ramps", "T1", channels, source="ramps.h5"))


def chi2(history, term=None, values=()):
    """Of the rows for a term with these values, and how many there are."""
    rows = tick_rows(history)
    acting = [] if term is None else [(term, values, scale_of([RememberedRun(history)], C))]
    left = rows.target - told(rows, acting, C, 0.0)
    return float(left @ left), left.size - 3


@pytest.mark.parametrize(
    ("response", "term", "values"),
    [
        (at_once, None, ()),
        (lagging(0.004), MotorLag("first_order"), (0.004,)),
        (late(0.0023), TimeSkew(), (0.0023,)),
        (ringing(63.0, 0.1), StandResonance(), (1.0, 63.0, 0.1)),
        (ringing(6.0, 0.1), StandResonance(), (1.0, 6.0, 0.1)),
        (lagging(0.3), MotorLag("first_order"), (0.3,)),
    ],
    ids=["at once", "lag", "delay", "ringing", "slow ringing", "slow lag"],
)
def test_the_true_response_leaves_noise_and_no_other_does(response, term, values):
    history = ramped(response)
    right, rows = chi2(history, term, values)
    assert right < rows + 5 * np.sqrt(2 * rows)
    others = [
        (None, ()),
        (MotorLag("first_order"), (0.004,)),
        (TimeSkew(), (0.0023,)),
        (StandResonance(), (1, 63, 0.1)),
    ]
    wrong = [chi2(history, t, v)[0] for t, v in others if (t, v) != (term, values) and (values or t is not None)]
    assert min(wrong) > right + 100 or max(values[:1], default=0) == 0.3


def test_a_lag_shorter_than_the_spacing_is_measured():
    history = ramped(lagging(0.0011))
    tried = np.linspace(0.0005, 0.002, 31)
    found = tried[np.argmin([chi2(history, MotorLag("first_order"), (tau,))[0] for tau in tried])]
    assert found == pytest.approx(0.0011, abs=0.0001)


def test_a_gain_that_is_off_by_some_per_cent_is_no_mismatch_of_the_response():
    history = ramped(at_once)
    rows = tick_rows(history)
    left = rows.target - told(rows, [], 0.93 * C, 0.0)
    assert float(left @ left) < left.size + 5 * np.sqrt(2 * left.size)


def test_sparse_samples_or_levels_have_no_rows():
    t = np.arange(0.0, 60.0, 0.02)
    start = np.arange(0.0, 60.0, 3.0)
    level = np.tile([0.0, 5.0, -5.0, 8.0], 5)
    volts = level[np.searchsorted(start, t, side="right") - 1]

    def history(at, value, time):
        force = C * np.abs(volts) * volts if time is t else np.zeros(time.size)
        channels = (
            Channel("command_voltage", "command", "command_voltage", "V", at, value),
            Channel("thrust", "cell", "thrust", "N", time, force + 1e-3 * np.arange(time.size) % 0.01),
        )
        return history_of(Recording("r", "T1", channels, source="r.h5"))

    assert tick_rows(history(t, volts, t)) is None
    assert tick_rows(history(start, level, np.arange(0.0, 60.0, 0.003))) is None
