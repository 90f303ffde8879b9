"""The covariance of a fit whose clock ended where it can: a lag on a ramp is hardly told from a delay of the rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.mismatch.estimate.fit_covariance import covariance
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.whitening import weights
from identification.mismatch.noise.covariance import Noise
from identification.physics.dead_band import DeadBand
from identification.physics.motor_lag import MotorLag
from tests.identification.mismatch.model.test_rate_between_steps import PER_DRIVER, TAU, ramping

BAND, LAG = DeadBand("shrink"), MotorLag("first_order")
LATE, MOST = 0.0005, 0.0003
"""s: by which the rate is stamped late, and by which a fit lets it be."""


def test_a_clock_at_its_bound_may_be_anywhere_within():
    data = ramping(0.6, 0.0, BAND)
    h = data.histories[0]
    late = h.rate - LATE * np.gradient(h.rate, h.middle)
    data = replace(data, histories=(replace(h, rate=late),), most_shift=MOST)
    w = weights(data, Noise(0.1**2, 0.0), [np.zeros(r.size) for r in data.rows], Noise(0.004**2, 0.0))
    found = fit(Model((BAND, LAG)), Theta(0.2, ((0.6,), (TAU,)), (0.0,), k=PER_DRIVER), data, w)
    assert abs(found.theta.rate_shift) == MOST
    at = found.layout.of(LAG).start
    cov = covariance(found, data, w)
    off = abs(found.theta.terms[1][0] - TAU)
    assert 3 * np.sqrt(cov[at, at]) > off > 3 * found.std[at], "taken for known there"
    assert np.all(np.diag(cov)[[0, found.layout.k]] > 0)
    inside = fit(found.model, found.theta, replace(data, most_shift=2 * LATE), w)
    assert np.array_equal(covariance(inside, replace(data, most_shift=2 * LATE), w), np.nan_to_num(inside.cov))
