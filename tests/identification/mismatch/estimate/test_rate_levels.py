"""Levels of a measured rate beside a fit that heard little of them."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.estimate.rate_levels import contradiction, rate_by_levels
from identification.physics.dead_band import DeadBand
from identification.physics.winding_resistance import WindingResistance
from identification.recording import Channel
from tests.identification.diagnosed_runs import levels
from tests.identification.mismatch.small import known_noise, placed, short

WINDING, BAND = WindingResistance(), DeadBand()
LOSS = 0.003


def lossy(V):
    return 2 * V / (1 + np.sqrt(1 + 4 * LOSS * np.abs(V)))


def fitted(values, curve, k=1.0, seconds=80.0, noise=0.005):
    """A model at these values, and a rate of curve(V) that overshoots for a moment after each step."""
    start, level = levels(0, seconds)
    t = np.arange(0.0, seconds, 0.02)
    at = np.maximum(np.searchsorted(start, t, side="right") - 1, 0)
    over = 0.3 * (level[at] - level[np.maximum(at - 1, 0)]) * np.exp(-(t - start[at]) / 0.05)
    rate = curve(level[at]) + over + noise * np.random.default_rng(1).standard_normal(t.size)
    turning = Channel("rotation_rate", "motor", "rotation_rate", "rev/s", t, rate)
    recording = short(volts=curve, extra=(turning,), seconds=seconds)
    data, estimate = known_noise({}, [recording])
    model, theta = placed(values, estimate.fit.theta)
    return replace(estimate.fit, model=model, theta=replace(theta, k=k)), data


def test_a_curve_that_the_levels_exclude_is_told_with_both_errors():
    told = contradiction(WINDING, *fitted({WINDING: (LOSS,)}, lambda V: V))
    assert told == "levels of the measured rate are missed by up to 0.39 % of the largest, by 0.0069 % without it"


@pytest.mark.parametrize("noise", [0.005, 1.0])
def test_a_curve_that_they_have_is_not_contradicted(noise):
    assert contradiction(WINDING, *fitted({WINDING: (LOSS,)}, lossy, noise=noise)) == ""
    assert contradiction(WINDING, *fitted({WINDING: (LOSS,), BAND: (0.0,)}, lossy, noise=noise)) == ""


def test_of_two_curves_the_one_that_is_not_there_is_contradicted():
    fit, data = fitted({WINDING: (LOSS,), BAND: (0.5,)}, lossy)
    assert contradiction(BAND, fit, data) != ""
    assert contradiction(WINDING, fit, data) == ""


def test_too_few_levels_exclude_nothing():
    fit, data = fitted({WINDING: (LOSS,)}, lambda V: V, seconds=12.0)
    assert len(set(np.round(np.abs(data.histories[0].driver), 3))) <= 3
    assert contradiction(WINDING, fit, data) == ""
    assert rate_by_levels(replace(fit, theta=replace(fit.theta, k=1.1)), data) is None


@pytest.mark.parametrize("k", [0.9, 1.01])
def test_a_rate_per_driver_that_the_levels_exclude_is_theirs(k):
    fit, data = fitted({}, lambda V: V, k)
    value, std = rate_by_levels(fit, data)
    assert value == pytest.approx(1.0, abs=4 * std)
    assert 0 < std < 1e-3


def test_one_that_they_have_stays_the_fits():
    fit, data = fitted({}, lambda V: V, 1.0001, noise=0.05)
    assert rate_by_levels(fit, data) is None
