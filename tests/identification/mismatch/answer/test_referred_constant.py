"""C of a thruster whose thrust follows the measured rate is of the same voltage as that of any other."""

import numpy as np
import pytest

from identification.mismatch.answer.report_assembly import constant_of, values_of
from identification.recording import Channel
from tests.identification.diagnosed_runs import NOISE, C, dead_band, levels
from tests.identification.mismatch.small import estimated, short
from tests.identification.physics.one_term import term

BAND, COUPLING = term("dead_band", "shrink"), term("rotation_coupling")
SECONDS, EVERY, PER_VOLT = 80.0, 0.1, 2.0


def turned(t, share):
    """Of the voltage beyond the dead band: a rotor that a slow wave makes quicker and slower by 4 %."""
    return 1 + share * 0.04 * np.sin(2 * np.pi * t / 23.0)


@pytest.fixture(scope="module", params=[1.0, 0.4])
def followed(request):
    """Thrust follows that rate wholly, or in part."""
    start, level = levels(0, SECONDS)
    t = np.arange(0.05, SECONDS, EVERY)
    x = dead_band(1.0)(level[np.searchsorted(start, t, side="right") - 1])
    noise = 0.002 * np.random.default_rng(3).standard_normal(t.size)
    rate = Channel("rate", "tachometer", "rotation_rate", "rev/s", t, PER_VOLT * x * turned(t, 1.0) + noise)

    def thrust(at, V, F):
        return F * turned(at, request.param) ** 2

    run = short(thrust, volts=dead_band(1.0), extra=(rate,), noise=0.1 * NOISE)
    return estimated({BAND: (1.0,), COUPLING: (request.param,)}, [run])


def test_it_is_that_of_the_rotors_voltage_and_not_of_the_rate_as_it_was_scaled(followed):
    data, estimate = followed
    own = estimate.fit.theta.C
    told, error = constant_of(estimate.fit, data)
    assert data.histories[0].rate_per_driver < 0.95 * PER_VOLT, "a dead band makes the rate per volt smaller"
    assert abs(own / C - 1) > 0.03
    assert abs(told - C) < min(3 * error, 0.3 * abs(own - C))
    assert (values_of(estimate.fit, data)["C"].value, values_of(estimate.fit, data)["C"].std) == (told, error)


def test_its_error_is_that_of_every_parameter_in_it(followed):
    """Against differences of C by each parameter, and their covariance."""
    data, estimate = followed
    fitted = estimate.fit
    k, share = fitted.theta.k, fitted.values[COUPLING][0]
    scaled = data.histories[0].rate_per_driver
    at = [fitted.layout.C, fitted.layout.of(COUPLING).start, fitted.layout.k]

    def referred(c, s, rate):
        return c * (1 + s * (rate / scaled - 1)) ** 2

    here = np.array([fitted.theta.C, share, k])
    step = 1e-6 * here
    slopes = np.array([(referred(*(here + d)) - referred(*(here - d))) / (2 * d.sum()) for d in np.diag(step)])
    expected = np.sqrt(slopes @ np.nan_to_num(fitted.cov)[np.ix_(at, at)] @ slopes)
    assert constant_of(fitted, data)[1] == pytest.approx(expected, rel=1e-5)
