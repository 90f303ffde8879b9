import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.estimation.regression import least_squares, weighted


def problem(seed, n=30, p=3):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(n, p)), rng.normal(size=n), rng


@given(st.integers(0, 10_000), st.integers(1, 5))
def test_plain_agrees_with_numpy(seed, p):
    H, y, _ = problem(seed, p=p)
    fit = least_squares(H, y, tuple("abcde"[:p]))
    expected, *_ = np.linalg.lstsq(H, y, rcond=None)
    assert fit.theta == pytest.approx(expected, abs=1e-9)
    s2 = np.sum((y - H @ expected) ** 2) / (30 - p)
    assert fit.sigma2 == pytest.approx(s2)
    assert fit.cov == pytest.approx(s2 * np.linalg.inv(H.T @ H), abs=1e-12)
    assert fit.singular_values == pytest.approx(np.linalg.svd(H, compute_uv=False))
    assert fit.solver @ y == pytest.approx(fit.theta)
    assert fit.chi2 is None


@pytest.mark.parametrize("full", [False, True])
def test_weighted_agrees_with_the_formula(full):
    H, y, rng = problem(1)
    std = rng.uniform(0.5, 3, 30)
    B = rng.normal(size=(30, 30))
    Sigma = B @ B.T + np.eye(30) if full else np.diag(std**2)
    fit = least_squares(H, y, ("a", "b", "c"), Sigma if full else std)
    W = np.linalg.inv(Sigma)
    cov = np.linalg.inv(H.T @ W @ H)
    assert fit.theta == pytest.approx(cov @ H.T @ W @ y)
    assert fit.cov == pytest.approx(cov)
    assert fit.chi2 == pytest.approx((y - H @ fit.theta) @ W @ (y - H @ fit.theta))
    assert fit.solver @ y == pytest.approx(fit.theta)
    assert fit.sigma2 is None


def test_one_number_for_all_rows():
    H, y, _ = problem(2)
    a, b = least_squares(H, y, ("a", "b", "c"), 2.0), least_squares(H, y, ("a", "b", "c"), np.full(30, 2.0))
    assert a.cov == pytest.approx(b.cov)
    assert a.std == pytest.approx(np.sqrt(np.diag(a.cov)))


def test_deficiency_names_the_combination():
    H, y, _ = problem(3)
    H[:, 2] = 2 * H[:, 1]
    fit = least_squares(H, y, ("a", "b", "c"))
    assert fit.deficiency is not None
    assert set(fit.deficiency.names) == {"b", "c"}
    assert "b" in fit.deficiency.statement
    assert np.isfinite(fit.std[0])
    assert np.isnan(fit.std[1:]).all()
    assert fit.condition == np.inf
    assert fit.dof == 28


def test_an_empty_column_and_too_few_rows():
    H, y, _ = problem(4)
    H[:, 0] = 0
    assert least_squares(H, y, ("a", "b", "c")).deficiency.names == ("a",)
    few = least_squares(H[:1], y[:1], ("a", "b", "c"))
    assert few.deficiency is not None
    assert few.dof == 0
    assert np.isnan(few.sigma2)


def test_bad_conditioning_survives_scaling():
    t = np.linspace(0, 1, 200)
    H = np.column_stack([1e8 * t, 1e-6 * np.ones(200)])
    theta = np.array([3e-8, 2e6])
    assert least_squares(H, H @ theta, ("a", "b")).theta == pytest.approx(theta, rel=1e-9)


def test_misuse_is_refused():
    H, y, _ = problem(5)
    with pytest.raises(ValueError, match="do not fit together"):
        least_squares(H, y[:-1], ("a", "b", "c"))
    with pytest.raises(ValueError, match="must be finite"):
        least_squares(H * np.nan, y, ("a", "b", "c"))
    with pytest.raises(ValueError, match="above zero"):
        weighted(H, y, np.zeros(30))
