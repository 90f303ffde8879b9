import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from identification.estimation.regression import Deficiency
from identification.experiment_design.experiment import (
    GAP_AFTER,
    Candidates,
    Design,
    Impossible,
    copper_heat,
    optimal_levels,
)

X = np.linspace(-1, 1, 101)
V = np.linspace(-20, 20, 41)


def polynomial(x, degree):
    return Candidates(x, x[:, None] ** np.arange(degree + 1), tuple("abcdef"[: degree + 1]))


def thruster(**more):
    return Candidates(V, np.column_stack([V * np.abs(V), V, np.ones(41)]), ("C", "k", "tare"), **more)


@pytest.mark.parametrize(("degree", "support"), [(1, [-1, 1]), (2, [-1, 0, 1])])
def test_known_d_optimal_polynomial_designs(degree, support):
    """Guest (1958): the ends and the zeros of Legendre's P'_k, all with the same weight."""
    found = optimal_levels(polynomial(X, degree), 10.0)
    assert isinstance(found, Design)
    assert found.levels == pytest.approx(support)
    assert found.weights == pytest.approx(1 / (degree + 1), abs=1e-4)
    assert found.dwells.sum() == pytest.approx(10.0)


def test_known_d_optimal_cubic_and_a_optimal_parabola():
    x = np.append(np.linspace(-1, 1, 21), [-np.sqrt(0.2), np.sqrt(0.2)])
    found = optimal_levels(polynomial(x, 3), 1.0)
    assert isinstance(found, Design)
    assert found.weights[np.abs(np.abs(found.levels) - np.sqrt(0.2)) < 0.03].sum() == pytest.approx(0.5, abs=0.01)
    found = optimal_levels(polynomial(X, 2), 1.0, "A")
    assert isinstance(found, Design)
    assert found.levels == pytest.approx([-1, 0, 1])
    assert found.weights == pytest.approx([0.25, 0.5, 0.25], abs=1e-3)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10_000), st.sampled_from(["D", "A"]), st.sampled_from([np.inf, 0.5]))
@example(512, "D", 0.5)  # a trace of a cool level was left out, and with it the limit
def test_equivalence_theorem_holds_and_no_other_design_is_better(seed, criterion, limit):
    rng = np.random.default_rng(seed)
    H, heat = rng.normal(size=(12, 2)), rng.uniform(0, 1, 12)
    heat[0] = 0.1
    found = optimal_levels(Candidates(np.arange(12.0), H, ("a", "b"), heat=heat), 1.0, criterion, limit)
    assert isinstance(found, Design)
    assert found.gap <= GAP_AFTER
    assert found.mean_heat <= limit + 1e-9
    value = {"D": np.linalg.det, "A": np.trace}[criterion]
    for _ in range(200):
        w = rng.dirichlet(np.full(12, 0.3))
        if w @ heat <= limit and np.linalg.cond(M := H.T @ (w[:, None] * H)) < 1e12:
            assert value(np.linalg.inv(M)) >= value(found.cov) * (1 - 3 * GAP_AFTER)


def test_heating_moves_time_to_lower_levels():
    free = optimal_levels(thruster(heat=copper_heat(V, 20.0)), 60.0)
    cool = optimal_levels(thruster(heat=copper_heat(V, 20.0)), 60.0, max_mean_heat=0.05)
    assert isinstance(free, Design)
    assert isinstance(cool, Design)
    assert free.mean_heat > 0.5
    assert cool.mean_heat == pytest.approx(0.05, abs=1e-6)
    assert np.linalg.det(cool.cov) > np.linalg.det(free.cov)
    assert np.all(cool.std > 0)
    assert "s at" in cool.statement


def test_noisier_levels_get_less_time():
    quiet = optimal_levels(thruster(), 60.0, "A", size=np.array([0.4, 1.0, 1.0]))
    noisy = optimal_levels(thruster(sigma=np.where(V > 15, 5.0, 1.0)), 60.0, "A", size=np.array([0.4, 1.0, 1.0]))
    assert isinstance(quiet, Design)
    assert isinstance(noisy, Design)
    assert noisy.dwells[noisy.levels > 15].sum() < quiet.dwells[quiet.levels > 15].sum()
    assert quiet.mean_heat is None


def test_what_no_choice_of_levels_tells_is_named():
    found = optimal_levels(Candidates(V, np.column_stack([V, 2 * V]), ("a", "b")), 1.0)
    assert isinstance(found, Deficiency)
    assert found.names == ("a", "b")


def test_a_limit_that_no_level_keeps():
    found = optimal_levels(thruster(heat=np.ones(41)), 1.0, max_mean_heat=0.5)
    assert isinstance(found, Impossible)
    assert "0.5" in found.statement


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"candidates": Candidates(V[:-1], np.ones((41, 1)), ("a",), sigma=np.ones(40))}, "broadcast|fit"),
        ({"candidates": Candidates(V, np.ones((41, 1)), ("a", "b"))}, "fit"),
        ({"candidates": thruster(heat=np.ones(3))}, "fit"),
        ({"total_time": 0.0}, "above 0 s"),
        ({"max_mean_heat": 0.5}, "needs the heat"),
    ],
)
def test_misuse_is_told(arguments, message):
    with pytest.raises(ValueError, match=message):
        optimal_levels(**{"candidates": thruster(), "total_time": 1.0} | arguments)
