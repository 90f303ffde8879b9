"""Noise that its model cannot describe raises the bar by as much as it is louder; noise that it describes does not."""

import numpy as np
import pytest

from identification.mismatch.select.family_wise import orthogonal_basis
from identification.mismatch.select.overdispersion import dispersion

ROWS = 6000
AFTER_STEPS = np.arange(ROWS) % 50 < 10


def span(rng):
    """A shape that is there after every step only."""
    columns = rng.standard_normal((ROWS, 6)) * AFTER_STEPS[:, None]
    return orthogonal_basis(columns)


def test_white_noise_raises_nothing():
    rng = np.random.default_rng(1)
    found = [dispersion(span(rng), rng.standard_normal(ROWS)) for _ in range(20)]
    assert min(found) == 1.0
    assert np.mean(found) < 1.15


def test_noise_after_every_step_raises_the_bar_by_its_variance():
    rng = np.random.default_rng(2)
    found = [dispersion(span(rng), rng.standard_normal(ROWS) * np.where(AFTER_STEPS, 3.0, 1.0)) for _ in range(10)]
    assert np.mean(found) == pytest.approx(9.0, rel=0.1)


def test_what_a_shape_takes_is_no_noise():
    rng = np.random.default_rng(3)
    known = span(rng)
    found = dispersion(known, rng.standard_normal(ROWS) + known @ np.full(known.shape[1], 100.0))
    assert found < 1.5


def test_an_empty_span_raises_nothing():
    assert dispersion(np.empty((ROWS, 0)), np.ones(ROWS)) == 1.0
