import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.estimation.information import (
    Efficiency,
    differences,
    efficiency,
    excitation,
    linear_information,
    model_information,
    score_information,
)
from identification.estimation.regression import Deficiency, least_squares
from identification.velocity.linear_drag import THESIS_EXAMPLE, LinearDrag, linear_drag_response

NAMES = ("a", "b", "c")


@given(st.integers(0, 10_000), st.sampled_from(["one", "each", "full"]))
def test_linear_information_is_the_formula(seed, kind):
    rng = np.random.default_rng(seed)
    H, B = rng.normal(size=(20, 3)), rng.normal(size=(20, 20))
    std = rng.uniform(0.5, 2, 20)
    sigma, Sigma = {
        "one": (0.7, 0.49 * np.eye(20)),
        "each": (std, np.diag(std**2)),
        "full": (B @ B.T + np.eye(20), B @ B.T + np.eye(20)),
    }[kind]
    found = linear_information(H, NAMES, sigma)
    M = H.T @ np.linalg.inv(Sigma) @ H
    assert found.matrix == pytest.approx(M)
    assert found.bound == pytest.approx(np.linalg.inv(M))
    assert found.std == pytest.approx(np.sqrt(np.diag(np.linalg.inv(M))))
    assert found.bound == pytest.approx(least_squares(H, np.zeros(20), NAMES, sigma).cov)


def drag_model(t):
    return lambda theta: linear_drag_response(t, LinearDrag(theta[0], theta[1], 35.0, 25.0, 0.1963), theta[2])[0]


def test_model_information_by_differences_and_by_jacobian():
    t = np.arange(540) / 3
    theta = np.array([500.0, 170.0, 0.0])
    found = model_information(drag_model(t), theta, ("m", "k_l", "x0"), 0.07)
    h = 1e-30

    def exact(theta):
        columns = []
        for i in range(3):
            shifted = theta.astype(complex)
            shifted[i] += 1j * h
            columns.append(np.imag(drag_model(t)(shifted)) / h)
        return np.column_stack(columns)

    known = model_information(drag_model(t), theta, ("m", "k_l", "x0"), 0.07, jacobian=exact)
    assert found.std == pytest.approx(known.std, rel=1e-6)
    assert differences(drag_model(t), theta) == pytest.approx(exact(theta), rel=1e-6, abs=1e-9)


def test_the_definition_by_scores_agrees_and_least_squares_is_efficient():
    rng = np.random.default_rng(1)
    H, sigma, N = rng.normal(size=(15, 3)), 0.5, 20_000
    noise = sigma * rng.normal(size=(N, 15))
    known = linear_information(H, NAMES, sigma)
    scores = score_information(noise @ H / sigma**2, NAMES)
    assert scores.matrix == pytest.approx(known.matrix, rel=0.05, abs=0.05 * np.abs(known.matrix).max())
    estimates = noise @ np.linalg.pinv(H).T
    found = efficiency(np.cov(estimates.T), known)
    assert isinstance(found, Efficiency)
    assert found.overall == pytest.approx(1.0, abs=0.03)
    assert found.worst == pytest.approx(1.0, abs=0.06)


def test_throwing_data_away_costs_efficiency():
    rng = np.random.default_rng(2)
    H = rng.normal(size=(40, 3))
    half = least_squares(H[:20], np.zeros(20), NAMES, 1.0).cov
    found = efficiency(half, linear_information(H, NAMES, 1.0))
    assert isinstance(found, Efficiency)
    assert found.worst <= min(found.per_parameter) <= max(found.per_parameter) < 1
    assert found.worst < found.overall < 1
    assert "%" in found.statement
    L = np.linalg.cholesky(half)
    inner = np.linalg.solve(L, np.linalg.inv(H.T @ H))
    assert found.worst == pytest.approx(np.linalg.eigvalsh(np.linalg.solve(L, inner.T))[0])


def test_excitation_measures():
    rng = np.random.default_rng(3)
    H = rng.normal(size=(30, 3)) * np.array([1.0, 10.0, 100.0])
    found = excitation(H, NAMES)
    G = H.T @ H
    assert found.det == pytest.approx(np.linalg.det(G))
    assert found.trace == pytest.approx(np.trace(G))
    assert found.condition == pytest.approx(np.linalg.cond(G))
    assert found.scaled_condition == pytest.approx(np.linalg.cond(H / np.linalg.norm(H, axis=0)))
    assert found.singular_values == pytest.approx(np.linalg.svd(H, compute_uv=False))
    assert found.persistently_exciting
    assert found.statement.startswith("persistently exciting")
    weighted = excitation(H, NAMES, 2.0)
    assert weighted.trace == pytest.approx(found.trace / 4)


def test_variance_of_a_parameter_is_not_sigma_over_its_singular_value():
    """Section 4.1.1 prints sigma_theta_i^2 = sigma^2 / s_i^2: true along the columns of V only."""
    H = np.random.default_rng(4).normal(size=(30, 3)) @ np.array([[1, 2, 0], [0, 1, 3], [0, 0, 1.0]])
    _, s, Vt = np.linalg.svd(H, full_matrices=False)
    cov = least_squares(H, np.zeros(30), NAMES, 1.0).cov
    assert np.diag(Vt @ cov @ Vt.T) == pytest.approx(1 / s**2)
    assert np.diag(cov) == pytest.approx(np.sum(Vt.T**2 / s**2, axis=1))
    assert np.abs(np.diag(cov) * s**2 - 1).max() > 1


def test_unseen_combination_is_named():
    V = np.array([12.0, -12.0, 12.0, -12.0])
    H = np.column_stack([V * np.abs(V), V, np.ones(4)])
    found = excitation(H, ("C", "k", "tare"))
    assert not found.persistently_exciting
    assert found.deficiency is not None
    assert set(found.deficiency.names) == {"C", "k"}
    assert (found.det, found.log_det, found.condition) == (0.0, -np.inf, np.inf)
    information = linear_information(H, ("C", "k", "tare"), 1.0)
    assert np.isnan(information.std[:2]).all()
    assert information.std[2] == pytest.approx(0.5)
    assert isinstance(efficiency(np.eye(3), information), Deficiency)


def test_inertia_of_the_example_is_seen():
    t = np.arange(540) / 3
    found = model_information(drag_model(t), np.array([THESIS_EXAMPLE.m, THESIS_EXAMPLE.k_l, 0.0]), NAMES, 0.07)
    assert found.deficiency is None
    assert 0 < found.std[0] < 10
