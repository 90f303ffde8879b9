"""Whitening of several runs, and of a baseline that is uncertain itself, beside the dense covariance of all rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.model.data import PriorPredictionFactor
from identification.mismatch.model.whitening import Weights, weights
from identification.mismatch.noise.covariance import Noise
from tests.identification.mismatch.small import data_of, rng, short

NOISE = Noise(0.09, 0.0004, (2.0,), (0.05,))


@pytest.fixture(scope="module")
def two():
    """Two runs of which every fifth row is left out."""
    data, _ = data_of([short(seed=s, seconds=18.0, rate=4.0) for s in (0, 1)])
    keep = tuple(np.arange(h.rows.size) % 5 != 0 for h in data.histories)
    return replace(data, keep=keep)


def covariance(data, sizes, factor=None):
    """Dense: samples of one row each, so that a row's mean is the sample."""
    n = data.size
    K, at = np.zeros((n, n)), 0
    for rows, F in zip(data.thrust_rows, sizes, strict=True):
        assert np.all(rows.count == 1)
        lag = np.abs(rows.time[:, None] - rows.time[None, :])
        here = slice(at, at + rows.time.size)
        K[here, here] = NOISE.slow[0] * np.exp(-lag / NOISE.scales[0])
        K[here, here] += np.diag(NOISE.white + NOISE.proportional * F**2)
        at += rows.time.size
    return K if factor is None else K + factor @ factor.T


def sizes_of(data):
    return [0.5 * h.driver[r] * np.abs(h.driver[r]) for h, r in zip(data.histories, data.rows, strict=True)]


def check(found: Weights, K, data):
    y = rng(1).standard_normal((data.size, 3))
    ends = np.cumsum([r.size for r in data.rows])[:-1]
    z = found.whiten(np.split(y, ends), [])
    assert z.T @ z == pytest.approx(y.T @ np.linalg.solve(K, y), rel=1e-8)
    assert found.log_det == pytest.approx(np.linalg.slogdet(K)[1], rel=1e-9)
    single = found.whiten([c[:, 0] for c in np.split(y, ends)], [])
    assert single == pytest.approx(z[:, 0])


def test_quadratic_form_and_determinant_are_those_of_the_dense_covariance(two):
    sizes = sizes_of(two)
    check(weights(two, NOISE, sizes, None), covariance(two, sizes), two)


def test_a_baseline_that_is_uncertain_adds_its_columns_to_the_covariance(two):
    """Three directions, two of which are one: as if their variances added up."""
    sizes = sizes_of(two)
    rows = [h.rows.size for h in two.histories]
    columns = [rng(5).standard_normal((n, 2)) @ np.array([[1.0, 0.0, 1.0], [0.0, 2.0, 0.0]]) for n in rows]
    factor = PriorPredictionFactor(tuple(columns), ())
    data = replace(two, prior_factor=factor)
    dense = np.concatenate([c[k] for c, k in zip(columns, two.keep, strict=True)])
    check(weights(data, NOISE, sizes, None), covariance(two, sizes, dense), data)
    unit = weights(data, NOISE, sizes, None, unit=True)
    check(unit, covariance(two, sizes), data)
