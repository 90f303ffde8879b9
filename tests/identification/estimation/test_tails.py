"""Tails and quantiles against scipy.stats, right down to the smallest float."""

import subprocess
import sys

import numpy as np
import pytest
from scipy import stats

from identification.estimation.tails import (
    chi2_isf,
    chi2_sf,
    fisher_sf,
    gamma_median,
    gamma_sf,
    noncentral_chi2_sf,
    normal_quantile,
    normal_sf,
    poisson_mixture,
    student_quantile,
    student_sf,
)

X = np.array([-1.0, 0.0, 1e-6, 0.3, 1.0, 4.0, 30.0, 300.0, 1360.0])


@pytest.mark.parametrize("dof", [1, 2, 7, 40])
def test_central_tails(dof):
    np.testing.assert_allclose(chi2_sf(X, dof), stats.chi2.sf(X, dof), rtol=1e-12)
    np.testing.assert_allclose(gamma_sf(X, 0.5 * dof), stats.gamma.sf(X, 0.5 * dof), rtol=1e-12)
    np.testing.assert_allclose(student_sf(X, dof), stats.t.sf(X, dof), rtol=1e-10)
    np.testing.assert_allclose(fisher_sf(X, dof, 57.6), stats.f.sf(X, dof, 57.6), rtol=1e-10)
    assert chi2_isf(2e-4, dof) == pytest.approx(stats.chi2.isf(2e-4, dof), rel=1e-12)
    assert gamma_median(0.5 * dof) == pytest.approx(stats.gamma.median(0.5 * dof), rel=1e-12)


def test_normal_tail_down_to_the_smallest_float():
    x = np.array([-3.0, 0.0, 2.0, 10.0, 37.0])
    np.testing.assert_allclose(normal_sf(x), stats.norm.sf(x), rtol=1e-12)
    assert 0 < float(normal_sf(37.0)) < 1e-299


@pytest.mark.parametrize("p", [1e-6, 0.025, 0.5, 0.975, 1 - 1e-9])
def test_quantiles(p):
    dof = np.array([0.5, 1.0, 7.3, 1e4, np.inf])
    np.testing.assert_allclose(student_quantile(p, dof), stats.t.ppf(p, dof), rtol=1e-12, atol=1e-15)
    assert float(normal_quantile(p)) == pytest.approx(stats.norm.ppf(p), rel=1e-12, abs=1e-15)
    np.testing.assert_allclose(student_sf(2.5, dof), stats.t.sf(2.5, dof), rtol=1e-10)
    assert np.isnan(student_quantile(p, 0.0)), "no degrees of freedom, no interval"


@pytest.mark.parametrize("dof", [1, 3, 17, 200])
@pytest.mark.parametrize("noncentrality", [1e-8, 0.5, 20.0, 3e3, 1e6])
def test_noncentral_tail(dof, noncentrality):
    spread = np.sqrt(2 * (dof + 2 * noncentrality))
    for away in (-2.0, 0.0, 3.0, 10.0):
        x = dof + noncentrality + away * spread
        if x > 0:
            expected = float(stats.ncx2.sf(x, dof, noncentrality))
            assert noncentral_chi2_sf(x, dof, noncentrality) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("noncentrality", [0.01, 4.0, 500.0])
def test_noncentral_tail_far_out(noncentrality):
    """One degree of freedom is known exactly: the sum has it down to 1e-300."""
    for p in (1e-30, 1e-150, 1e-300):
        root = float(np.sqrt(noncentrality)) + float(stats.norm.isf(p))
        exact = noncentral_chi2_sf(root**2, 1, noncentrality)
        assert exact == pytest.approx(p, rel=1e-9) or noncentrality < 1  # there the other side counts too
        assert poisson_mixture(root**2, 1, noncentrality) == pytest.approx(exact, rel=1e-8)


def test_nothing_and_everything():
    assert noncentral_chi2_sf(0.0, 3, 2.0) == 1.0
    assert noncentral_chi2_sf(4.0, 3, 0.0) == float(chi2_sf(4.0, 3))


def test_a_diagnosis_starts_without_the_heavy_parts_of_scipy():
    code = (
        "import sys, rig.diagnose.command, rig.diagnose.text, rig.hdf5, identification.mismatch.pipeline;"
        "print([m for m in ('scipy.stats', 'scipy.signal', 'scipy.ndimage', 'pydantic', 'can') if m in sys.modules])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"
