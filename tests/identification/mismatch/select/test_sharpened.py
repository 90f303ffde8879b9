"""A threshold that was found is as sharp as it is, where a tick of the command comes close to it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.whitening import weights
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.select.forward_selection import Selected
from identification.mismatch.select.sharpened import sharpened
from identification.physics.dead_band import DeadBand
from identification.physics.motor_lag import MotorLag
from tests.identification.mismatch.model import test_rate_between_steps
from tests.identification.mismatch.model.test_rate_between_steps import PER_DRIVER, TAU, ramping

BAND, LAG = DeadBand("jump"), MotorLag("first_order")
NOISE, RATE_NOISE = 0.02, 0.004
"""N, rev/s."""
FINE = 0.0005
"""V between the values that a command takes."""


def found(threshold):
    """A model of a band and a lag as a search leaves it."""
    data = ramping(threshold, 0.0, BAND)
    noisy = np.random.default_rng(7)
    h = data.histories[0]
    loud = replace(
        h,
        thrust=h.thrust + NOISE * noisy.standard_normal(h.thrust.size) / np.sqrt(np.maximum(h.count, 1)),
        rate=h.rate + RATE_NOISE * noisy.standard_normal(h.rate.size) / np.sqrt(np.maximum(h.rate_count, 1)),
    )
    data = replace(data, histories=(loud,), most_shift=0.0)
    white = Noise(NOISE**2, 0.0), Noise(RATE_NOISE**2, 0.0)
    model, theta = Model((BAND, LAG)), Theta(0.2, ((threshold,), (TAU,)), (0.0,), k=PER_DRIVER)
    w = weights(data, white[0], [np.zeros(r.size) for r in data.rows], white[1])
    after = Estimate(fit(model, theta, data, w), *white, w, data.thrust_rows)
    bare = Estimate(fit(*after.fit.less(BAND, LAG), data, w), *white, w, data.thrust_rows)
    return Selected(data, (BAND, LAG), bare, after, (), None)


@pytest.mark.parametrize("threshold", [0.5952, 0.5977, 0.6028])
def test_ticks_on_either_side_of_a_threshold_are_told_apart(monkeypatch, threshold):
    """Ticks 0.5 mV apart beside a jump that is spread over 1.8 mV: each turned the rotor a part of it."""
    monkeypatch.setattr(test_rate_between_steps, "LATTICE", FINE)
    before = found(threshold)
    after = sharpened(before, np.random.default_rng(1))
    fitted = after.after.fit
    assert fitted.chi2 < before.after.fit.chi2 - 500
    (band,) = [term for term in after.terms if term.id == "dead_band"]
    assert band == BAND.sharp() != BAND
    assert abs(fitted.values[band][0] - threshold) < FINE
    assert abs(fitted.values[LAG][0] - TAU) < 4 * fitted.std[fitted.layout.of(LAG)][0]


def test_where_no_tick_comes_close_it_stays_as_it_was():
    before = found(15.5 * test_rate_between_steps.LATTICE)
    assert sharpened(before, np.random.default_rng(1)) is before
    undone = replace(before, undone=("all",))
    assert sharpened(undone, np.random.default_rng(1)) is undone
