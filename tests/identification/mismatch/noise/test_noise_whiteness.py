"""Whether what was whitened is white, beside Ljung and Box's statistic written out and its distribution."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from identification.mismatch.noise.whiteness import LAGS, whiteness
from tests.identification.mismatch.small import rng


def by_definition(parts):
    """Ljung and Box, Biometrika 65, 297 (1978), eq. 1.3, of several runs."""
    total, dof = 0.0, 0
    for e in parts:
        e, n = e - e.mean(), e.size
        r = [np.sum(e[k:] * e[:-k]) / np.sum(e * e) for k in range(1, min(LAGS, n // 5) + 1)]
        total += n * (n + 2) * sum(c**2 / (n - k) for k, c in enumerate(r, 1))
        dof += len(r)
    return chi2.sf(total, dof)


@pytest.mark.parametrize("sizes", [(400,), (300, 60), (300, 40, 12)])
def test_it_is_the_textbooks_p_value_run_by_run(sizes):
    parts = [rng(i).standard_normal(n) for i, n in enumerate(sizes)]
    assert whiteness(np.concatenate(parts), sizes) == pytest.approx(by_definition(parts), rel=1e-6)


def test_what_comes_after_the_runs_is_not_looked_at():
    e = rng(3).standard_normal(500)
    beyond = np.concatenate([e, np.full(200, 50.0)])
    assert whiteness(beyond, [500]) == whiteness(e, [500])


def test_of_white_noise_p_values_are_even():
    found = [whiteness(rng(seed).standard_normal(400), [400]) for seed in range(300)]
    assert kstest(found, "uniform").pvalue > 0.01


def test_one_outlier_does_not_hide_what_is_correlated():
    e = rng(4).standard_normal(600)
    e = e[1:] + 0.4 * e[:-1]
    assert whiteness(e, [599]) < 1e-6
    e[300] = 1e6
    assert whiteness(e, [599]) < 1e-6


def test_a_repeated_residual_in_two_runs_is_no_correlation_across_them():
    """The last of one run and the first of the next are no neighbours."""
    e = rng(5).standard_normal(500)
    assert whiteness(np.tile(e, 2), [500, 500]) == pytest.approx(by_definition([e, e]), rel=1e-6)


def test_a_constant_and_a_run_too_short_are_no_error():
    assert whiteness(np.zeros(100), [100]) == 1.0
    assert whiteness(np.ones(3), [3]) == 1.0
