import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from identification.estimation.verdicts import residual_variance, significance, underfit, whiteness
from tests.identification.thrust_runs import ar1


@given(st.floats(0.01, 1e3), st.floats(0.01, 1e3))
def test_rule_of_eq_4_11(value, std):
    verdict = significance(value, std)
    assert verdict.significant == (verdict.percent < verdict.threshold)
    assert verdict.p_value == pytest.approx(2 * norm.sf(value / std))
    assert ("not" in verdict.statement) == (not verdict.significant)


def test_threshold_of_the_thesis():
    assert significance(1, 0.5).threshold == pytest.approx(51.02, abs=0.01)
    assert significance(1, 0.45, dof=3).significant is False


def test_edges_of_significance():
    assert significance(1.0, 0.0).significant
    assert not significance(0.0, 0.0).significant
    assert not significance(float("nan"), 1.0).significant
    assert not significance(1.0, 0.1, dof=0).significant


def test_underfit_false_alarms_are_five_per_cent():
    chi2 = np.random.default_rng(0).chisquare(10, 2000)
    assert np.mean([underfit(float(c), 10).underfitted for c in chi2]) == pytest.approx(0.05, abs=0.015)


def test_underfit_words():
    assert "not underfitted" in underfit(10, 10).statement
    assert "exceed" in underfit(100, 10).statement
    assert "cannot be judged" in underfit(0, 0).statement
    assert np.isnan(underfit(0, 0).per_dof)


def test_residual_variance_is_unbiased():
    rng = np.random.default_rng(1)
    found = []
    for _ in range(2000):
        H, e = rng.normal(size=(8, 2)), rng.normal(0, 3, 8)
        found.append(residual_variance(e - H @ np.linalg.lstsq(H, e, rcond=None)[0], 2))
    assert np.mean(found) == pytest.approx(9, rel=0.05)
    assert np.isnan(residual_variance(np.ones(2), 2))


def test_whiteness():
    rng = np.random.default_rng(2)
    assert np.mean([whiteness(rng.normal(size=100)).white for _ in range(300)]) > 0.9
    assert not whiteness(ar1(0.9)(rng, 200)[0]).white
    assert "not white" in whiteness(np.arange(20.0)).statement
    assert whiteness(np.ones(5)) is None
    assert whiteness(np.ones(20)).white
