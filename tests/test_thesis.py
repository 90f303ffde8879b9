"""Numbers and formulas printed in chapter 4 of the thesis, reproduced; where the print slips, the slip is shown."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from identification.velocity.linear_drag import THESIS_EXAMPLE, linear_drag_response, sine_derivative_bound
from identification.velocity.velocity import Window, derivative

TIME = np.arange(540) / 3.0
"""180 s at 3 Hz, "i.e. 540 data samples"."""
SIGMA = 0.07
FILTER = Window(10, 10)


def force(t, body):
    return body.f0 + body.delta_f * np.sin(body.omega * t)


def printed(t, body, x0=0.0):
    """Section 4.2.3 as printed: (x, dx/dt)."""
    tau, w, k = body.tau, body.omega, body.k_l
    gone = 1 - np.exp(-t / tau)
    below = 1 + w**2 * tau**2
    v = x0 * np.exp(-t / tau) + body.f0 / k * gone
    v += body.delta_f / k * (np.sin(w * t) - w * tau * (np.cos(w * t) - 1)) / below
    x = tau * (x0 - body.f0 / k) * gone + body.f0 / k * t
    x += body.delta_f / k * (w * tau * t - tau * np.sin(w * t) - np.cos(w * t) / w + 1 / w) / below
    return x, v


@pytest.mark.parametrize(("x0", "v0"), [(0.0, 0.0), (3.0, -0.4)])
def test_423_response_against_integration(x0, v0):
    body = THESIS_EXAMPLE
    run = solve_ivp(
        lambda t, s: [s[1], (force(t, body) - body.k_l * s[1]) / body.m],
        (0.0, TIME[-1]), [x0, v0], method="DOP853", t_eval=TIME, rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    x, v = linear_drag_response(TIME, body, x0, v0)
    np.testing.assert_allclose(x, run.y[0], rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(v, run.y[1], rtol=0, atol=1e-9)


def complex_step(f, t):
    """Derivative to rounding error, without differences."""
    return np.imag(f(t + 1e-200j)) / 1e-200


def test_423_each_term_of_ours_satisfies_the_equation_and_the_printed_velocity_does_not():
    body = THESIS_EXAMPLE

    def ours(t):
        gone, wt = 1 - np.exp(-t / body.tau), body.omega * body.tau
        swing = body.delta_f / body.k_l / (1 + wt**2)
        sine = np.sin(body.omega * t) - wt * (np.cos(body.omega * t) - np.exp(-t / body.tau))
        return body.f0 / body.k_l * gone + swing * sine

    _, v = linear_drag_response(TIME, body)
    np.testing.assert_allclose(v, ours(TIME), atol=1e-14)
    balance = body.m * complex_step(ours, TIME) + body.k_l * ours(TIME) - force(TIME, body)
    assert np.abs(balance).max() < 1e-11
    slip = body.m * complex_step(lambda t: printed(t, body)[1], TIME) + body.k_l * printed(TIME, body)[1]
    wt = body.omega * body.tau
    offset = body.delta_f * wt / (1 + wt**2)
    np.testing.assert_allclose(slip - force(TIME, body), offset, rtol=1e-9)
    assert offset / body.k_l == pytest.approx(0.0637, abs=5e-5)


def test_423_printed_position_is_the_integral_of_the_printed_velocity():
    body = THESIS_EXAMPLE
    slope = complex_step(lambda t: printed(t, body, 0.2)[0], TIME)
    np.testing.assert_allclose(slope, printed(TIME, body, 0.2)[1], atol=1e-12)
    assert printed(180.0, body)[0] - linear_drag_response(np.array(180.0), body)[0] == pytest.approx(11.3, abs=0.1)


def test_423_filtered_velocity_errs_by_its_predicted_noise_and_bias():
    x, v = linear_drag_response(TIME, THESIS_EXAMPLE)
    rng = np.random.default_rng(423)
    runs = 300
    rms, whole_record = [], []
    for _ in range(runs):
        found = derivative(TIME, x + SIGMA * rng.normal(size=x.size), FILTER, 4, ends="slide")
        error = found.velocity - v
        rms.append(np.mean(error[found.whole] ** 2))
        whole_record.append(error)
    clean = derivative(TIME, x, FILTER, 4, ends="slide")
    bias = (clean.velocity - v)[clean.whole]
    predicted = clean.std(SIGMA)[clean.whole] ** 2 + bias**2
    margin = 4 * np.std(rms) / np.sqrt(runs)
    assert np.mean(rms) == pytest.approx(predicted.mean(), abs=margin)
    assert margin < 0.05 * predicted.mean()
    assert np.sqrt(np.mean(rms)) == pytest.approx(0.0191, abs=2e-4)
    spread = np.std(whole_record, axis=0)
    np.testing.assert_allclose(spread, clean.std(SIGMA), rtol=4.5 / np.sqrt(2 * runs))


def test_423_bias_from_the_next_term():
    """Bias of the filter with noiseless data: predicted from the fifth derivative, and estimated from the samples."""
    x, v = linear_drag_response(TIME, THESIS_EXAMPLE)
    found = derivative(TIME, x, FILTER, 4, ends="leave out")
    late = found.whole & (TIME > 60)
    error = (found.velocity - v)[late]
    largest = np.abs(found.moment[late, 0]).max() * sine_derivative_bound(THESIS_EXAMPLE, 5) / 120
    assert np.abs(error).max() == pytest.approx(largest, rel=0.05)
    assert found.rms_bias(0.0) == pytest.approx(np.sqrt(np.nanmean((found.velocity - v) ** 2)), rel=0.1)
    np.testing.assert_allclose(found.bias[late], error, atol=0.1 * largest)
    assert largest < 0.01 * found.std(SIGMA)[late].max()


def test_derivative_bound_needs_a_second_derivative():
    with pytest.raises(ValueError, match="at least 2"):
        sine_derivative_bound(THESIS_EXAMPLE, 1)
