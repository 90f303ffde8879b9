"""How much of a fast change the static terms pass on, against slopes worked out by hand."""

import numpy as np
import pytest

from identification.mismatch.model.static_gain import rotor_gain, thrust_gain
from identification.physics.asymmetry import Asymmetry
from identification.physics.exponent import Exponent
from identification.physics.inflow_dynamics import InflowDynamics
from identification.physics.motor_lag import MotorLag
from identification.physics.recirculation import Recirculation
from identification.physics.winding_resistance import WindingResistance
from tests.identification.mismatch.small import data_of, placed, short


@pytest.fixture(scope="module")
def measured():
    return data_of([short()])


def gains(measured, values):
    data, theta = measured
    model, theta = placed(values, theta)
    (run,) = data.runs
    x = run.history.driver
    return x, rotor_gain(model, theta, run, data.scale), thrust_gain(model, theta, run, x, data.scale, 0.0)


def test_a_blade_for_one_direction_passes_on_its_share_of_it(measured):
    x, rotor, thrust = gains(measured, {Asymmetry(): (0.7,)})
    assert rotor == 1.0
    assert thrust[x < 0] == pytest.approx(0.7)
    assert thrust[x > 0] == pytest.approx(1.0)


def test_water_that_is_accelerated_first_adds_half_its_share(measured):
    """F = C x|x| + C |x| share (x - u): by x, where u has followed, C (2 + share) |x|."""
    x, _, thrust = gains(measured, {InflowDynamics(): (0.4, 0.2)})
    settled = (np.abs(x) > 1) & (measured[0].runs[0].history.since_step > 2.0)
    assert np.mean(thrust[settled]) == pytest.approx(1.2, abs=0.02)
    assert thrust[settled] == pytest.approx(1.2, abs=0.1), "intervals are not all as long"


def test_a_loss_in_the_winding_slows_by_its_own_slope(measured):
    """V = x + r x|x|: dx/dV = 1/(1 + 2 r |x|)."""
    loss = 0.01
    V, rotor, thrust = gains(measured, {WindingResistance(): (loss,)})
    x = np.sign(V) * (np.sqrt(1 + 4 * loss * np.abs(V)) - 1) / (2 * loss)
    assert rotor == pytest.approx(1 / (1 + 2 * loss * np.abs(x)), rel=1e-3)
    assert thrust == 1.0


def test_another_exponent_is_as_steep_as_it_says(measured):
    """C x^2 |x/a|^0.4: by x, over 2 C |x|, it is 1.2 |x/a|^0.4."""
    x, _, thrust = gains(measured, {Exponent(): (2.4,)})
    largest = measured[0].scale.driver
    far = np.abs(x) > 1
    ratio = thrust[far] / (1.2 * np.abs(x[far] / largest) ** 0.4)
    assert ratio == pytest.approx(np.median(ratio), rel=1e-3)
    assert thrust[np.argmax(np.abs(x))] == pytest.approx(1.2, rel=0.01)


def test_dynamics_have_answers_of_their_own_and_slow_ones_pass_all_on(measured):
    _, rotor, thrust = gains(measured, {MotorLag("first_order"): (0.1,), Recirculation("rate"): (0.02, 20.0)})
    assert (rotor, thrust) == (1.0, 1.0)
