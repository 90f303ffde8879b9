"""Confidence intervals beside a dense profile: chi-square, least over all else, on a grid, by scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq, least_squares

from identification.mismatch.estimate.confidence_intervals import Profile, intervals
from identification.physics.dead_band import DeadBand
from identification.physics.exponent import Exponent
from tests.identification.diagnosed_runs import NOISE, TOP, dead_band
from tests.identification.mismatch.small import known_noise, short

BENT = Exponent()


@pytest.fixture(scope="module")
def bent():
    """An exponent known to a few per cent: loud noise, few seconds."""
    noise = 6.0
    run = short(noise=noise, seconds=40.0, volts=lambda V: np.sign(V) * (np.abs(V) / TOP) ** 0.9 * TOP)
    return known_noise({BENT: (1.8,)}, [run], noise), noise


def profiled(data, noise, exponent):
    """Chi-square of this exponent: C and the tare by linear least squares."""
    h, r = data.histories[0], data.rows[0]
    w = np.sqrt(h.count[r]) / noise
    u = np.sign(h.driver[r]) * (np.abs(h.driver[r]) / TOP) ** exponent
    X = np.column_stack([u, np.ones(u.size)]) * w[:, None]
    y = h.thrust[r] * w
    return float(np.sum((y - X @ np.linalg.lstsq(X, y, rcond=None)[0]) ** 2))


def test_a_profile_is_the_dense_one(bent):
    (data, estimate), noise = bent
    rise = Profile(estimate.fit, data, estimate.weights, 1)
    (best,) = estimate.fit.values[BENT]
    least = profiled(data, noise, best)
    assert estimate.fit.chi2 == pytest.approx(least, abs=0.01)
    for exponent in (best - 0.2, best - 0.05, best + 0.1, best + 0.3):
        assert rise(exponent) == pytest.approx(profiled(data, noise, exponent) - least, rel=0.03, abs=0.03)


def test_it_ends_where_chi_square_has_risen_by_3_84(bent):
    (data, estimate), noise = bent
    (found,) = intervals(estimate.fit, data, estimate.weights, (BENT,))[BENT]
    (best,) = estimate.fit.values[BENT]
    least = profiled(data, noise, best)
    ends = [brentq(lambda p: profiled(data, noise, p) - least - 3.8415, *each) for each in ((0.9, best), (best, 3.4))]
    width = ends[1] - ends[0]
    assert abs(found.low - ends[0]) < 0.04 * width
    assert abs(found.high - ends[1]) < 0.04 * width


def test_only_terms_that_are_asked_for_have_one(bent):
    (data, estimate), _ = bent
    assert intervals(estimate.fit, data, estimate.weights, ()) == {}


def test_of_forty_runs_nearly_all_hold_the_truth():
    """95 %: at most six of forty are without it, and not none of any forty with half the width."""
    band, held, narrow = DeadBand(), 0, 0
    for seed in range(40):
        run = short(volts=dead_band(1.2), seed=seed, seconds=30.0, rate=4.0)
        data, estimate = known_noise({band: (1.0,)}, [run])
        (found,) = intervals(estimate.fit, data, estimate.weights, (band,))[band]
        middle, half = 0.5 * (found.low + found.high), 0.5 * (found.high - found.low)
        held += abs(middle - 1.2) <= half
        narrow += abs(middle - 1.2) <= 0.5 * half
    assert held >= 34
    assert narrow < 36


def test_standard_errors_are_those_of_a_refit_by_scipy():
    band = DeadBand()
    data, estimate = known_noise({band: (1.0,)}, [short(volts=dead_band(1.2))])
    h, r = data.histories[0], data.rows[0]

    def residual(p):
        x = np.sign(h.driver[r]) * np.maximum(np.abs(h.driver[r]) - p[1], 0.0)
        return (h.thrust[r] - p[0] * x * np.abs(x) - p[2]) * np.sqrt(h.count[r]) / NOISE

    theirs = least_squares(residual, [0.5, 1.2, 1.5])
    cov = np.linalg.inv(theirs.jac.T @ theirs.jac)
    ours = estimate.fit.cov[:3, :3]
    assert ours == pytest.approx(cov, rel=0.02, abs=1e-3 * float(np.abs(cov).max()))
