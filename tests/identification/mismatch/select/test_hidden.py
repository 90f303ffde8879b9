"""What slow noise takes for its own no screening shows; estimating both tells it apart, and of noise alone nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from identification.mismatch import policy
from identification.mismatch.estimate.estimate import refresh
from identification.mismatch.select.forward_selection import Thruster
from identification.mismatch.select.hidden import asked_of, hidden
from identification.physics.dead_band import DeadBand
from identification.physics.stand_resonance import StandResonance
from identification.physics.zero_drift import ZeroDrift
from identification.physics.zero_offset import ZeroOffset
from identification.recording import Acquisition, Channel, Recording
from tests.identification.diagnosed_runs import dead_band
from tests.identification.mismatch.small import estimated, rng, short

DRIFT, JUMP, BAND = ZeroDrift(), ZeroOffset(), DeadBand()
RATE = 0.008
"""N/s: 0.6 N in a run whose samples scatter by 0.3 N."""


def screened(recording, values=None, terms=(DRIFT, JUMP, BAND)):
    """The runs, a model fitted with its noise, and what a screening says beside it."""
    data, estimate = estimated(values or {}, [recording])
    return data, estimate, Thruster(data, terms).judged(estimate, rng(0))


def drifting(seed=0, rate=RATE):
    return short(change=lambda t, _V, F: F + rate * t, seed=seed)


@pytest.mark.parametrize("seed", range(3))
def test_a_drift_that_the_noise_holds_is_found_though_no_screening_shows_it(seed):
    data, estimate, judged = screened(drifting(seed))
    assert judged.largest < judged.threshold, "it is hidden"
    assert np.sqrt(sum(estimate.noise.slow)) > 0.08, "N; there is none in the run"
    told, better = hidden(estimate, judged, data)
    assert better.fit.model.terms == (DRIFT,)
    error = better.fit.std[better.fit.layout.of(DRIFT)][0]
    assert better.fit.values[DRIFT][0] == pytest.approx(RATE, abs=4 * error)
    assert error < 0.25 * RATE
    assert told.gain > told.asked == asked_of(DRIFT, judged, data)
    assert np.sqrt(sum(better.noise.slow)) < 0.06, "the noise is given back what is not its own"


@pytest.mark.parametrize("seed", range(4))
def test_of_noise_alone_nothing_is_told(seed):
    data, estimate, judged = screened(short(seed=seed))
    assert hidden(estimate, judged, data) is None


def test_slow_noise_that_is_there_stays_noise():
    """A walk that wanders by half a newton in twenty seconds, and comes back."""
    walk = np.cumsum(rng(7).standard_normal(640)) * 0.02
    walk -= np.linspace(walk[0], walk[-1], walk.size)
    data, estimate, judged = screened(short(change=lambda _t, _V, F: F + walk))
    assert np.sqrt(sum(estimate.noise.slow)) > 0.08
    assert hidden(estimate, judged, data) is None


def test_a_jump_is_found_at_its_instant():
    data, estimate, judged = screened(short(change=lambda t, _V, F: F + 0.4 * (t > 40)))
    _, better = hidden(estimate, judged, data)
    size, instant = better.fit.values[JUMP]
    assert size == pytest.approx(0.4, abs=0.1)
    assert instant == pytest.approx(40.0, abs=1.0)


def test_what_shows_less_than_it_must_is_not_tried():
    data, estimate, judged = screened(drifting())
    faint = replace(judged, plain=judged.plain * 0.99 * policy.select.HIDDEN_SIGMA / judged.plain.max())
    assert hidden(estimate, judged, data) is not None
    assert hidden(estimate, faint, data) is None


def test_a_term_that_is_not_slow_must_be_the_first():
    """Beside another one the error of that one's shape would be taken for it."""
    data, estimate, judged = screened(short(volts=dead_band(0.6)), terms=(BAND,))
    found = hidden(estimate, judged, data)
    assert found is not None
    assert found[1].fit.values[BAND][0] == pytest.approx(0.6, abs=0.05)
    data, estimate, judged = screened(short(volts=dead_band(0.6)), {DRIFT: (0.0,)}, terms=(BAND,))
    assert judged.plain.max() > policy.select.HIDDEN_FIRST_TERM_SIGMA
    assert hidden(estimate, judged, data) is None


def test_what_is_asked_of_a_gain_goes_with_how_the_term_was_looked_for():
    data, _, judged = screened(short())
    logn, threshold = float(np.log(data.size)), judged.threshold**2
    assert asked_of(DRIFT, judged, data) == pytest.approx(stats.chi2.isf(policy.select.STEADY_TERM_FALSE_ALARM, 1))
    assert asked_of(JUMP, judged, data) == pytest.approx(threshold + 2 * policy.select.HIDDEN_OFFSET_PRICE * logn)
    assert asked_of(BAND, judged, data) == pytest.approx(threshold + policy.select.HIDDEN_TERM_PRICE * logn)
    ringing = StandResonance()
    full = threshold + len(ringing.parameters(data.scale)) * logn
    assert asked_of(ringing, judged, data) == pytest.approx(full)


def ticking(seed: int) -> Recording:
    """A slow sine in ticks, its rate read between them and 2 ms late; the zero jumps, slowly enough for noise."""
    draw, when = rng(seed), np.arange(0.0, 240.0, 0.02)
    level = 8.7 * np.sin(2 * np.pi * when / 35.0)

    def at(t):
        return level[np.clip(np.searchsorted(when, t, side="right") - 1, 0, None)]

    t, r = np.arange(0.005, 240.0, 1 / 92), np.arange(0.0031, 240.0, 0.01003)
    F = 0.673 * at(t) * np.abs(at(t)) + draw.normal(0.0, 0.4, t.size) - 0.09 * (t > 150.2)
    n = 2.055 * at(r - 0.002) + draw.normal(0.0, 0.017, r.size)
    channels = (
        Channel(
            "command_voltage", "command", "command_voltage", "V", when, level, acquisition=Acquisition(delay_std=0.002)
        ),
        Channel("thrust", "cell", "thrust", "N", t, F),
        Channel("rotation_rate", "motor", "rotation_rate", "rev/s", r, n),
    )
    return Recording("ticking", "T1", channels)


def test_terms_are_compared_with_what_is_without_them_by_the_same_clocks(monkeypatch):
    """One reading of the rate on the other side of a tick is worth more than what is asked of a term."""
    data, estimate = estimated({}, [ticking(2)], clocks=True)
    judged = Thruster(data, (JUMP,)).judged(estimate, rng(0))
    begun, ended = [], []

    def watched(model, theta, *others):
        begun.append((theta.shift, theta.rate_shift))
        ended.append(refresh(model, theta, *others))
        return ended[-1]

    monkeypatch.setattr("identification.mismatch.select.hidden.refresh", watched)
    told, _ = hidden(estimate, judged, data)
    now = ended[0].fit.theta
    assert now.rate_shift == pytest.approx(0.002, abs=2e-4)
    assert begun[1:-1] == [(now.shift, now.rate_shift)] * (len(begun) - 2)
    assert told.gain > told.asked
