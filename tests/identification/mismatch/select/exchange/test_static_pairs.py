"""Two terms of a static curve for two others, where each exchange alone would be worse."""

import numpy as np
import pytest

from identification.mismatch.select.exchange.static_pairs import two_for_two
from identification.mismatch.select.forward_selection import available
from tests.identification.diagnosed_runs import TOP
from tests.identification.mismatch.small import known_noise, short
from tests.identification.physics.one_term import term

BAND, WINDING = term("dead_band", "shrink"), term("winding_resistance")
KNEE, LINEAR = term("command_saturation", "knee"), term("linear_term")
W = 0.03
STD = 0.03


def motor(V):
    """A dead band of 0.7 V, and of 12 V a fifth lost in the winding: V = e + W e^2."""
    volts = np.sign(V) * np.maximum(np.abs(V) - 0.7, 0.0)
    return np.sign(volts) * (np.sqrt(1 + 4 * W * np.abs(volts)) - 1) / (2 * W)


@pytest.fixture(scope="module")
def recording():
    return short(volts=motor, noise=STD)


def test_a_drive_and_a_line_are_given_up_for_a_dead_band_and_a_winding(recording):
    data, estimate = known_noise({KNEE: (0.03, 0.2 * TOP), LINEAR: (-0.5,)}, [recording], STD)
    loss, fitted = two_for_two(estimate, data, available(data))
    assert set(fitted.model.terms) == {BAND, WINDING}
    assert loss < -20
    assert fitted.values[BAND][0] == pytest.approx(0.7, abs=0.02)
    assert fitted.values[WINDING][0] == pytest.approx(W, abs=0.001)


def test_the_right_two_stay(recording):
    data, estimate = known_noise({BAND: (0.7,), WINDING: (W,)}, [recording], STD)
    assert two_for_two(estimate, data, available(data)) is None


def test_nor_are_two_asked_that_share_no_curve(recording):
    data, estimate = known_noise({BAND: (0.7,), term("asymmetry"): (0.99,)}, [recording], STD)
    assert two_for_two(estimate, data, available(data)) is None
