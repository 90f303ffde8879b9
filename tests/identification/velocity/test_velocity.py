import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import savgol_filter

from identification.velocity.local_polynomial import coefficient_rows, is_even
from identification.velocity.velocity import Adaptive, Derivative, Window, derivative

EVEN = np.arange(60) / 4


def uneven(rng, n=60):
    return np.cumsum(rng.uniform(0.05, 0.6, n))


@given(st.integers(0, 10_000), st.integers(1, 5), st.integers(3, 12))
def test_even_times_agree_with_scipy(seed, order, half):
    rng = np.random.default_rng(seed)
    y = rng.normal(size=60) + 1e3
    order = min(order, 2 * half)
    found = derivative(EVEN, y, Window(half, half), order, ends="slide")
    slope = savgol_filter(y, 2 * half + 1, order, deriv=1, delta=0.25, mode="interp")
    assert found.velocity == pytest.approx(slope, abs=1e-7)
    assert found.position == pytest.approx(savgol_filter(y, 2 * half + 1, order, mode="interp"), abs=1e-7)
    assert np.sum(~found.whole) == 2 * half
    assert f"{2 * half} near the ends" in found.statement


def direct(time, y, i, low, high, order):
    """numpy.polyfit, one window at a time."""
    return np.polyfit(time[low:high] - time[i], y[low:high], order)[-2]


@pytest.mark.parametrize(("n_l", "n_r", "order"), [(6, 6, 3), (10, 0, 2), (0, 7, 2), (8, 3, 4)])
@pytest.mark.parametrize("even", [True, False])
def test_any_window_agrees_with_polyfit(n_l, n_r, order, even):
    rng = np.random.default_rng(5)
    time = EVEN if even else uneven(rng)
    y = rng.normal(size=60)
    found = derivative(time, y, Window(n_l, n_r), order)
    for i in range(60):
        low, high = max(0, i - n_l), min(60, i + n_r + 1)
        assert (found.left[i], found.right[i]) == (i - low, high - 1 - i)
        if high - low > order:
            assert found.velocity[i] == pytest.approx(direct(time, y, i, low, high, order), abs=1e-8)
        else:
            assert np.isnan(found.velocity[i])
    assert "none" in found.statement


def test_causal_uses_nothing_from_ahead():
    rng = np.random.default_rng(6)
    y, later = rng.normal(size=60), rng.normal(size=60)
    later[:40] = y[:40]
    a, b = (derivative(EVEN, data, Window(9, 0), 2).velocity for data in (y, later))
    np.testing.assert_array_equal(a[:40], b[:40])
    assert a[40] != b[40]


@given(st.integers(0, 10_000), st.integers(1, 4), st.booleans())
def test_a_polynomial_comes_back_exactly_and_the_next_terms_as_bias(seed, order, even):
    rng = np.random.default_rng(seed)
    time = EVEN if even else uneven(rng)
    exact = np.polynomial.Polynomial(rng.normal(size=order + 1), domain=[0, time[-1]], window=[-1, 1])
    higher = np.polynomial.Polynomial(rng.normal(size=order + 3), domain=[0, time[-1]], window=[-1, 1])
    window = Window(7, 5)
    found = derivative(time, exact(time), window, order)
    assert found.velocity == pytest.approx(exact.deriv()(time), abs=1e-7)
    assert found.bias == pytest.approx(np.zeros(60), abs=1e-6)
    found = derivative(time, higher(time), window, order)
    known = np.isfinite(found.bias)
    error = found.velocity - higher.deriv()(time)
    assert found.bias[known] == pytest.approx(error[known], abs=1e-5)
    factorial = np.prod(np.arange(1, order + 2))
    next_terms = np.column_stack(
        [higher.deriv(order + 1)(time) / factorial, higher.deriv(order + 2)(time) / factorial / (order + 2)]
    )
    assert np.sum(found.moment * next_terms, axis=1) == pytest.approx(error, abs=1e-7)


@pytest.mark.parametrize("even", [True, False])
def test_noise_passed_on_is_what_monte_carlo_gives(even):
    rng = np.random.default_rng(7)
    time = EVEN if even else uneven(rng)
    runs = [derivative(time, 0.3 * rng.normal(size=60), Window(6, 4), 3) for _ in range(600)]
    v = np.array([run.velocity for run in runs])
    assert np.std(v, axis=0) == pytest.approx(runs[0].std(0.3), rel=0.12)
    biases = np.array([run.bias for run in runs])
    assert np.std(biases, axis=0) == pytest.approx(0.3 * runs[0].bias_gain, rel=0.12)
    assert np.sqrt(np.mean([run.position_noise**2 for run in runs])) == pytest.approx(0.3, rel=0.01)
    assert runs[0].std() == pytest.approx(runs[0].std(runs[0].position_noise))


def test_rms_bias_is_cleared_of_noise():
    time = np.arange(2000) / 10
    rng = np.random.default_rng(8)
    x = np.sin(0.75 * time)
    found = derivative(time, x + 0.01 * rng.normal(size=2000), Window(10, 10), 2)
    true = (derivative(time, x, Window(10, 10), 2).velocity - 0.75 * np.cos(0.75 * time))[found.whole]
    assert found.rms_bias(0.01) == pytest.approx(np.sqrt(np.mean(true**2)), rel=0.15)
    assert derivative(time, time, Window(10, 10), 2).rms_bias(0.01) == 0.0
    assert np.isnan(derivative(time[:4], x[:4], Window(2, 2), 2).rms_bias(0.01))


def test_ends_left_out():
    found = derivative(EVEN, EVEN**2, Window(3, 2), 2, ends="leave out")
    assert np.isnan(found.velocity[[0, 1, 2, -1, -2]]).all()
    assert np.isfinite(found.velocity[3:-2]).all()


def test_adaptive_order_is_low_where_straight_and_high_where_it_bends():
    time = np.arange(600) / 10
    rng = np.random.default_rng(9)
    x = np.where(time < 30, time, 30 + 2 * np.sin(2.5 * (time - 30)) / 2.5 + (time - 30) * -1)
    y = x + 0.01 * rng.normal(size=600)
    v = np.where(time < 30, 1.0, 2 * np.cos(2.5 * (time - 30)) - 1)
    adaptive = derivative(time, y, Window(12, 12), Adaptive(1, 7), ends="slide")
    assert np.mean(adaptive.order[20:270] == 1) > 0.85
    assert np.median(adaptive.order[330:-20]) >= 3
    for fixed in (1, 7):
        other = derivative(time, y, Window(12, 12), fixed, ends="slide")
        assert rms(adaptive, v) < rms(other, v)


def rms(found: Derivative, v):
    return float(np.sqrt(np.mean((found.velocity - v)[20:-20] ** 2)))


def test_adaptive_on_uneven_times_and_false_alarms():
    rng = np.random.default_rng(10)
    time = uneven(rng, 2000)
    found = derivative(time, rng.normal(size=2000), Window(8, 8), Adaptive(2, 4, alpha=0.05))
    assert np.mean(found.order[found.whole] == 4) == pytest.approx(0.05, abs=0.02)
    assert found.order[0] == 2


def test_adaptive_without_room_keeps_the_lowest():
    found = derivative(EVEN, EVEN**3, Window(2, 2), Adaptive(2, 4))
    assert set(found.order) == {2}


def test_equal_times_are_no_slope():
    time = np.array([0.0, 1.0, 1.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    found = derivative(time, time, Window(1, 1), 1)
    assert np.isnan(found.velocity[2])
    assert found.velocity[5] == pytest.approx(1.0)
    found = derivative(np.zeros(3), np.zeros(3), Window(1, 1), 1)
    assert np.isnan(found.velocity).all()
    assert np.isnan(found.position_noise)


def test_short_window_gives_no_rows():
    assert np.isnan(coefficient_rows(np.zeros((2, 2)), 2)).all()
    assert is_even(np.array([0.0, 5.0]))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"time": EVEN[:-1]}, r"two \(n,\) arrays"),
        ({"position": np.full(60, np.nan)}, "missing samples"),
        ({"time": EVEN[::-1]}, "backwards"),
        ({"window": Window(9, 0), "ends": "slide"}, "cannot slide"),
        ({"order": 0}, "from 1 to 12"),
        ({"order": Adaptive(2, 13)}, "from 1 to 12"),
    ],
)
def test_misuse_is_told(arguments, message):
    with pytest.raises(ValueError, match=message):
        derivative(**{"time": EVEN, "position": EVEN, "window": Window(6, 6)} | arguments)


@pytest.mark.parametrize("make", [lambda: Window(-1, 2), lambda: Window(0, 0), lambda: Adaptive(3, 2)])
def test_windows_and_orders_that_cannot_be(make):
    with pytest.raises(ValueError, match="got"):
        make()
