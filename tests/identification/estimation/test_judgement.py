"""What section 4.1 allows one to say of a fit, with and without correlated residuals."""

import numpy as np
import pytest

from identification.estimation.judgement import judge, reduce_model
from identification.estimation.regression import least_squares
from tests.identification.thrust_runs import ar1, white

N = 400
X = np.linspace(-1, 1, N)
H = np.column_stack([np.ones(N), X, X**2])
NAMES = ("a", "b", "c")


def draws(noise, seed=0, runs=200, theta=(1.0, 0.5, 0.0), sigma=0.3):
    for e in noise(np.random.default_rng(seed), N, runs):
        yield H @ np.array(theta) + sigma * e


def test_white_residuals_give_the_printed_figures_twice():
    found = judge(H, next(draws(white, 3)), NAMES)
    for name in NAMES:
        assert found.std[name].corrected == pytest.approx(found.std[name].plain, rel=0.25)
    assert found.sigma.plain == pytest.approx(0.3, rel=0.1)
    assert found.dof.plain == N - 3
    assert found.dof.corrected > 0.8 * (N - 3)
    assert found.whiteness.white


@pytest.mark.parametrize(("phi", "plain_fails"), [(0.5, 0.1), (0.9, 0.3)])
def test_a_parameter_that_is_zero_is_called_significant_as_often_as_stated_only_after_correction(phi, plain_fails):
    found = [judge(H, y, NAMES).significance["c"] for y in draws(ar1(phi), 1)]
    assert np.mean([f.corrected.significant for f in found]) == pytest.approx(0.05, abs=0.04)
    assert np.mean([f.plain.significant for f in found]) > plain_fails


@pytest.mark.parametrize(("phi", "plain_fails"), [(0.5, 0.06), (0.9, 0.1)])
def test_a_true_model_is_called_underfitted_as_often_as_stated_only_after_correction(phi, plain_fails):
    found = [judge(H, y, NAMES, sigma=0.3) for y in draws(ar1(phi), 2)]
    assert np.mean([f.underfit.corrected.underfitted for f in found]) < 0.09
    assert np.mean([f.underfit.plain.underfitted for f in found]) > plain_fails
    assert all(f.dof.corrected < f.dof.plain for f in found)


def test_sigma_under_slow_noise_is_not_what_the_residual_alone_says():
    found = [judge(H, y, NAMES).sigma for y in draws(ar1(0.97), 4, runs=60)]
    plain, corrected = (np.median([getattr(f, s) for f in found]) for s in ("plain", "corrected"))
    assert plain < 0.26
    assert 0.25 < corrected < 0.36


def test_the_same_residual_is_not_asked_twice():
    y = next(draws(white, 5))
    known, unknown = judge(H, y, NAMES, sigma=0.3), judge(H, y, NAMES)
    assert known.sigma is None
    assert known.fit.sigma2 is None
    assert unknown.underfit is None
    assert unknown.fit.chi2 is None
    assert "cannot judge the fit" in " ".join(unknown.statements)
    assert "taken as independent" in " ".join(known.statements)


def test_a_model_that_lacks_something_is_underfitted():
    found = judge(H[:, :2], next(draws(white, 6, theta=(1, 0.5, 1.0))), NAMES[:2], sigma=0.3)
    assert found.underfit.plain.underfitted
    assert not found.whiteness.white


def test_what_remains_after_dropping():
    y = next(draws(white, 7))
    found = reduce_model(H, y, NAMES)
    assert found.dropped == ("c",)
    assert found.remaining.fit.names == ("a", "b")
    assert len(found.steps) == 2
    assert "what remains: a, b" in found.statement
    assert found.remaining.std["a"].plain < found.steps[0].std["a"].plain
    assert reduce_model(H, y, NAMES, keep=("c",)).dropped == ()
    assert "every parameter" in reduce_model(H[:, :2], y, NAMES[:2]).statement


def test_of_parameters_that_cannot_be_told_apart_the_last_goes():
    y = next(draws(white, 8))
    twice = np.column_stack([H[:, 0], H[:, 1], 2 * H[:, 1]])
    full = judge(twice, y, ("a", "b", "twice b"))
    assert "cannot tell the combination" in full.statements[0]
    assert np.isnan(full.std["b"].corrected)
    found = reduce_model(twice, y, ("a", "b", "twice b"))
    assert found.dropped == ("twice b",)
    assert found.remaining.significance["b"].corrected.significant


def test_as_many_samples_as_parameters():
    found = judge(np.array([[1.0, 0.0], [1.0, 1.0]]), np.array([1.0, 2.0]), ("a", "b"))
    assert "zero to rounding" in found.statements[-1]
    assert found.insignificant == ("a", "b")
    assert found.whiteness is None
    judged = judge(np.array([[1.0, 0.0], [1.0, 1.0]]), np.array([1.0, 2.0]), ("a", "b"), sigma=0.1)
    assert "cannot be judged" in judged.statements[-1]
    assert judged.significance["a"].corrected.significant


def test_no_other_linear_unbiased_estimator_is_better_than_blue():
    """Property 4 of section 4.1.1, by its own construction: any C with C H = I (eq. 4.7)."""
    rng = np.random.default_rng(9)
    A, half = H[::40], rng.standard_normal((10, 10))
    Sigma = half @ half.T + 0.1 * np.eye(10)
    fit = least_squares(A, np.zeros(10), NAMES, Sigma)
    assert fit.solver @ A == pytest.approx(np.eye(3), abs=1e-9)
    assert fit.solver @ Sigma @ fit.solver.T == pytest.approx(fit.cov)
    free = np.eye(10) - A @ np.linalg.pinv(A)
    for _ in range(50):
        C = fit.solver + rng.standard_normal((3, 10)) @ free
        assert np.abs(C @ A - np.eye(3)).max() < 1e-8
        assert np.linalg.eigvalsh(C @ Sigma @ C.T - fit.cov)[0] > -1e-9


def test_what_cannot_be_judged_is_said():
    assert judge(H, np.full(N, 1.5), NAMES).exact
    with pytest.raises(ValueError, match="nothing to fit: 0 rows"):
        judge(H[:0], np.zeros(0), NAMES)
