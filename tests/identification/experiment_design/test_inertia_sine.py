from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from identification.estimation.information import model_information
from identification.experiment_design.experiment import Impossible
from identification.experiment_design.inertia_sine import Limits, SineTest, Vehicle, best_sine, predict
from identification.velocity.linear_drag import LinearDrag, linear_drag_response

LINEAR = Vehicle(500.0, 170.0, 0.0)
LIMITS = Limits(90.0, 3.0, 0.07, max_force=60.0, max_travel=8.0, omega=(0.05, 1.0))


@pytest.mark.parametrize("k_std", [0.0, 17.0, np.inf])
def test_prediction_agrees_with_the_analytic_response(k_std):
    omega = 0.2
    vehicle = replace(LINEAR, k_std=k_std, f0=5.0)
    found = predict(np.array([40.0]), np.array([omega]), vehicle, LIMITS)
    t = np.arange(271) / 3.0
    x, v = linear_drag_response(t, LinearDrag(500.0, 170.0, 5.0, 40.0, omega))
    assert found.travel[0] == pytest.approx(np.ptp(x), rel=1e-3)
    assert found.speed[0] == pytest.approx(np.abs(v).max(), rel=1e-2)

    def model(theta):
        m, k, x0, v0 = theta
        return linear_drag_response(t, LinearDrag(m, k, 5.0, 40.0, omega), x0, v0)[0]

    M = model_information(model, np.array([500.0, 170.0, 0.0, 0.0]), ("m", "k", "x0", "v0"), 0.07).matrix
    known = M[np.ix_([0, 2, 3], [0, 2, 3])] if k_std == 0 else M + np.diag([0, 1 / k_std**2, 0, 0])
    assert found.m_std[0] == pytest.approx(np.sqrt(np.linalg.inv(known)[0, 0]), rel=1e-3)


def test_quadratic_drag_agrees_with_integration_and_differences():
    vehicle = Vehicle(500.0, 40.0, 300.0, k_std=np.inf, k_q_std=30.0)
    t = np.arange(271) / 3.0

    def model(theta):
        m, k, k_q, x0, v0 = theta
        run = solve_ivp(
            lambda t, s: [s[1], (50 * np.sin(0.3 * t) - k * s[1] - k_q * abs(s[1]) * s[1]) / m],
            (0.0, t[-1]), [x0, v0], method="DOP853", t_eval=t, rtol=1e-11, atol=1e-12, max_step=0.5,
        )  # fmt: skip
        return run.y[0]

    M = model_information(model, np.array([500.0, 40.0, 300.0, 0.0, 0.0]), ("m", "k", "k_q", "x0", "v0"), 0.07).matrix
    M[2, 2] += 1 / 30.0**2
    found = predict(np.array([50.0]), np.array([0.3]), vehicle, LIMITS)
    assert found.m_std[0] == pytest.approx(np.sqrt(np.linalg.inv(M)[0, 0]), rel=5e-3)
    assert found.travel[0] == pytest.approx(np.ptp(model([500.0, 40.0, 300.0, 0.0, 0.0])), rel=2e-3)


def test_best_sine_beats_every_other_on_a_fine_grid():
    best = best_sine(LINEAR, LIMITS)
    assert isinstance(best, SineTest)
    a, w = (part.ravel() for part in np.meshgrid(np.linspace(5, 60, 12), np.geomspace(0.05, 1.0, 30)))
    every = predict(a, w, LINEAR, LIMITS)
    allowed = every.travel <= LIMITS.max_travel
    assert best.m_std <= every.m_std[allowed].min() * 1.001
    assert best.travel <= 8.0
    assert best.amplitude <= 60.0


def test_less_room_means_a_faster_sine_and_a_worse_answer():
    wide, narrow = (best_sine(LINEAR, replace(LIMITS, max_travel=room)) for room in (8.0, 2.0))
    assert isinstance(wide, SineTest)
    assert isinstance(narrow, SineTest)
    assert narrow.omega > wide.omega
    assert narrow.m_std > wide.m_std


def test_limits_that_leave_nothing():
    assert isinstance(best_sine(replace(LINEAR, f0=-60.0), LIMITS), Impossible)
    found = best_sine(replace(LINEAR, f0=50.0), replace(LIMITS, max_travel=0.1))
    assert isinstance(found, Impossible)
    assert "travel" in found.statement


def test_unseen_inertia_has_no_bound():
    still = predict(np.array([0.0]), np.array([0.3]), LINEAR, LIMITS)
    assert still.m_std[0] == np.inf


def test_misuse_is_told():
    with pytest.raises(ValueError, match="5 samples"):
        best_sine(LINEAR, replace(LIMITS, duration=1.0))
