"""The standard error of a mean covers what it says, whatever the colour of the noise."""

import numpy as np
import pytest
from scipy.stats import t as student

from identification.estimation.even_noise import ar1_mean_variance, fit_noise, leverage
from identification.steady_state.shared_noise import fit_noise_jointly
from tests.identification.thrust_runs import ar1, flicker, white

RUNS = 300


def coverage(draw, n, seed=11):
    inside = 0
    for x in draw(np.random.default_rng(seed), n, RUNS):
        std, dof = fit_noise(x).mean_std()
        inside += abs(x.mean()) <= student.ppf(0.975, dof) * std
    return inside / RUNS


@pytest.mark.parametrize(
    ("draw", "n", "least"),
    [
        # least: what 1000 runs gave, less 3 sigma of 300 runs; the ideal is 0.95
        (white, 50, 0.92), (white, 100, 0.92), (white, 400, 0.91),
        (ar1(0.5), 100, 0.92), (ar1(0.9), 50, 0.89), (ar1(0.9), 100, 0.92), (ar1(0.9), 400, 0.90),
        (flicker(0.25), 50, 0.92), (flicker(0.25), 400, 0.92), (flicker(1.0), 100, 0.89), (flicker(1.0), 400, 0.88),
    ],
)  # fmt: skip
def test_mean_is_covered(draw, n, least):
    assert least <= coverage(draw, n) <= 1.0


def test_plain_standard_error_would_fail_where_this_one_holds():
    x = ar1(0.9)(np.random.default_rng(1), 400, 200)
    plain = np.abs(x.mean(axis=1)) <= 1.96 * x.std(axis=1, ddof=1) / 20
    assert plain.mean() < 0.5
    assert coverage(ar1(0.9), 400) > 0.9


def test_ar1_mean_variance_is_the_sum_of_the_autocovariance():
    n, tau = 37, 6.0
    lag = np.arange(n)
    direct = (1 + 2 * np.sum((1 - lag[1:] / n) * np.exp(-lag[1:] / tau))) / n
    assert ar1_mean_variance(n, np.array([tau]))[0] == pytest.approx(direct, rel=1e-12)


def test_a_dozen_windows_know_their_correlation_better_than_one():
    rng = np.random.default_rng(4)
    true = np.sqrt(ar1_mean_variance(100, np.array([-1 / np.log(0.9)]))[0])
    windows = list(ar1(0.9)(rng, 100, 12))
    alone = np.array([fit_noise(w).mean_std()[0] for w in windows])
    together = np.array([m.mean_std()[0] for m in fit_noise_jointly(windows)])
    assert np.mean(np.log(together / true) ** 2) < np.mean(np.log(alone / true) ** 2)


def test_windows_of_different_length_and_size():
    rng = np.random.default_rng(5)
    models = fit_noise_jointly([rng.normal(0, 1, 50), rng.normal(0, 10, 80)])
    assert models[0].std == pytest.approx(1, rel=0.4)
    assert models[1].std == pytest.approx(10, rel=0.4)


def test_linear_combination_of_white_noise():
    rng = np.random.default_rng(6)
    a = rng.normal(size=500)
    std, _ = fit_noise(rng.normal(0, 2, 500)).combination_std(a)
    assert std == pytest.approx(2 * np.linalg.norm(a), rel=0.15)


def test_spectrum_of_white_noise_is_flat():
    model = fit_noise(np.random.default_rng(7).normal(0, 3, 2000))
    assert model.spectrum(np.array([0.01, 0.1, 0.4])) == pytest.approx([9, 9, 9], rel=0.3)


def test_mean_variance_agrees_with_the_interval():
    model = fit_noise(np.random.default_rng(8).normal(0, 3, 2000))
    assert np.sqrt(model.mean_variance()) == pytest.approx(model.mean_std()[0], rel=0.2)


def test_leverage_of_a_full_basis_is_everything():
    Q, _ = np.linalg.qr(np.random.default_rng(9).normal(size=(6, 6)))
    assert leverage(Q) == pytest.approx(np.ones(6))


def test_constant_window_has_no_error():
    assert fit_noise(np.full(20, 3.0)).mean_std()[0] == 0.0


def test_too_few_samples_are_refused():
    with pytest.raises(ValueError, match="at least 5 samples, got 3"):
        fit_noise(np.zeros(3))
    assert fit_noise_jointly([]) == ()
