"""`least_squares` against scipy.optimize.least_squares, which walks another way to the same minimum."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import least_squares as oracle

from identification.mismatch.estimate.bounded_least_squares import least_squares
from identification.recording import Floats

TIME = np.linspace(0.0, 4.0, 80)
Curve = Callable[[Floats], Floats]


def decay(p: Floats) -> Floats:
    return np.asarray(p[0] * np.exp(-p[1] * TIME) + p[2])


def decay_slopes(p: Floats) -> Floats:
    fall = np.exp(-p[1] * TIME)
    return np.column_stack([fall, -p[0] * TIME * fall, np.ones(TIME.size)])


def lagged(p: Floats) -> Floats:
    return np.asarray(p[0] * np.tanh(p[1] * TIME) + p[2] * TIME)


def lagged_slopes(p: Floats) -> Floats:
    return np.column_stack([np.tanh(p[1] * TIME), p[0] * TIME / np.cosh(p[1] * TIME) ** 2, TIME])


FREE = np.full(3, -np.inf), np.full(3, np.inf)


@pytest.mark.parametrize(
    ("curve", "slopes", "low", "high"),
    [
        (decay, decay_slopes, *FREE),
        (lagged, lagged_slopes, *FREE),
        (decay, decay_slopes, np.array([0.0, 0.0, 0.5]), np.array([2.5, 5.0, 2.0])),  # two ends press
        (lagged, lagged_slopes, np.array([0.0, 0.1, -1.0]), np.array([10.0, 1.1, 1.0])),
    ],
)
@pytest.mark.parametrize("seed", range(3))
def test_the_minimum_is_that_of_scipy(curve: Curve, slopes: Curve, low: Floats, high: Floats, seed: int) -> None:
    rng = np.random.default_rng(seed)
    y = curve(np.array([3.0, 1.3, 0.2])) + 0.05 * rng.standard_normal(TIME.size)
    start = np.clip(np.array([1.0, 0.5, 1.0]), low, high)

    def residual(p: Floats) -> Floats:
        return np.asarray((y - curve(p)) / 0.05)

    found = least_squares(residual, lambda p: slopes(p) / 0.05, start, low, high)
    inside = np.clip(start, low + 1e-6, high - 1e-6)  # scipy begins within

    def falling(p: Floats) -> Floats:
        return -slopes(p) / 0.05

    wanted = oracle(residual, inside, falling, (low, high), xtol=1e-12, ftol=1e-12, gtol=1e-12)
    assert found.residual @ found.residual == pytest.approx(2 * wanted.cost, abs=0.01)
    std = np.sqrt(np.diag(np.linalg.pinv(found.slopes.T @ found.slopes)))
    assert np.all(np.abs(found.at - wanted.x) < 0.05 * std + 1e-6)
    assert np.all((low <= found.at) & (found.at <= high))
    np.testing.assert_array_equal(found.residual, residual(found.at))


def test_a_linear_problem_is_solved_whatever_its_units() -> None:
    rng = np.random.default_rng(0)
    H = rng.standard_normal((40, 3)) * np.array([1e-6, 1.0, 1e6])
    y = H @ np.array([1e6, 1.0, 1e-6]) + 0.1 * rng.standard_normal(40)
    found = least_squares(lambda p: y - H @ p, lambda _: H, np.zeros(3), *FREE)
    np.testing.assert_allclose(found.at, np.linalg.lstsq(H, y, rcond=None)[0], rtol=1e-3)


def test_a_parameter_whose_bounds_are_one_or_that_changes_nothing_stays() -> None:
    H = np.column_stack([np.ones(20), np.linspace(0, 1, 20), np.zeros(20)])
    y = H @ np.array([2.0, 3.0, 0.0])
    low, high = np.array([-10.0, 1.0, -np.inf]), np.array([10.0, 1.0, np.inf])
    found = least_squares(lambda p: 1e3 * (y - H @ p), lambda _: 1e3 * H, np.array([0.0, 0.0, 7.0]), low, high)
    assert found.at[1:].tolist() == [1.0, 7.0]
    assert found.at[0] == pytest.approx(3.0)


def test_a_step_into_what_has_no_value_is_shortened() -> None:
    def residual(p: Floats) -> Floats:
        with np.errstate(invalid="ignore"):
            return (0.1 - np.sqrt(p)) / 1e-3  # none below 0, where the first step goes

    low, high = np.array([-9.0]), np.array([9.0])
    found = least_squares(residual, lambda p: 500 / np.sqrt(p)[:, None], np.array([4.0]), low, high)
    assert found.at[0] == pytest.approx(0.01, rel=1e-3)


def test_what_is_hopeless_ends_early() -> None:
    looks: list[float] = []

    def residual(p: Floats) -> Floats:
        looks.append(float(p[0]))
        return 10 + 10 / (1 + p)

    def slopes(p: Floats) -> Floats:
        return np.asarray(10 / (1 + p)[None, :] ** 2)

    free = np.array([0.0]), np.array([np.inf])
    least_squares(residual, slopes, np.zeros(1), *free)
    whole = len(looks)
    looks.clear()
    least_squares(residual, slopes, np.zeros(1), *free, hopeless=50.0)
    assert len(looks) < whole


def test_slopes_are_asked_for_where_they_foretold_too_little_or_too_much() -> None:
    """A curve that hardly bends: what it did on the way tells its slopes well enough, until the end."""
    asked: list[Floats] = []
    rng = np.random.default_rng(2)
    y = lagged(np.array([3.0, 1.3, 0.2])) + 0.05 * rng.standard_normal(TIME.size)

    def slopes(p: Floats) -> Floats:
        asked.append(p.copy())
        return lagged_slopes(p) / 0.05

    found = least_squares(lambda p: np.asarray((y - lagged(p)) / 0.05), slopes, np.array([2.9, 1.2, 0.1]), *FREE)
    assert len(asked) <= 2
    assert found.slopes == pytest.approx(lagged_slopes(found.at) / 0.05, rel=1e-2, abs=1e-2)
