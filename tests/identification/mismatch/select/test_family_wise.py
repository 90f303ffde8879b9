"""P-values and thresholds of a family of looks: as often as they say on noise, and not blind to what is there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import chi2

from identification.mismatch.select.family_wise import beyond, family_p_value, family_threshold, orthogonal_basis
from identification.recording import Floats

ROWS = 400
SPANS = 8
LOOKS = np.random.default_rng(7).standard_normal((ROWS, 3 * SPANS)).cumsum(axis=0)
BASIS = orthogonal_basis(np.random.default_rng(8).standard_normal((ROWS, 4)))
WIDE = [beyond(LOOKS[:, 3 * i : 3 * i + 3], BASIS) for i in range(SPANS)]


def p_values(residual: Floats) -> list[float]:
    return [float(chi2.sf(np.sum((Q.T @ residual) ** 2), Q.shape[1])) for Q in WIDE]


def normal(rng: np.random.Generator) -> Floats:
    return rng.standard_normal(ROWS)


def heavy(rng: np.random.Generator) -> Floats:
    """Student's t of four degrees of freedom, of variance 1."""
    return np.asarray(rng.standard_t(4, ROWS) / np.sqrt(2))


@pytest.mark.parametrize("noise", [normal, heavy])
def test_on_noise_a_family_alarms_as_often_as_it_says(noise: Callable[[np.random.Generator], Floats]) -> None:
    rng = np.random.default_rng(0)
    found = [(e, p_values(e)) for e in (noise(rng) for _ in range(60))]
    alarms = [family_p_value(p, WIDE, e, rng) < 0.1 for e, p in found]
    assert np.sum(alarms) <= 13  # 6 are expected, 13 once in two hundred
    below = [min(p) < family_threshold(p, WIDE, e, rng, 0.1) for e, p in found]
    assert np.sum(below) <= 13
    assert np.mean(np.array(alarms) == np.array(below)) > 0.9


def test_structure_does_not_hide_itself_in_its_own_draws() -> None:
    rng = np.random.default_rng(1)
    residual = rng.standard_normal(ROWS) + 12 * WIDE[2] @ np.array([1.0, -1.0, 1.0])
    p = p_values(residual)
    assert family_p_value(p, WIDE, residual, rng) < 1e-6
    assert family_threshold(p, WIDE, residual, rng, 0.01) > 1e-4


def test_beyond_is_at_right_angles_to_the_basis_and_spans_the_rest() -> None:
    rng = np.random.default_rng(2)
    own = rng.standard_normal((ROWS, 2))
    columns = np.column_stack([1e6 * own[:, 0], BASIS @ np.ones(4), np.zeros(ROWS), own @ np.array([1.0, 1e-3])])
    found = beyond(columns, BASIS)
    assert found.shape == (ROWS, 2)
    np.testing.assert_allclose(found.T @ found, np.eye(2), atol=1e-12)
    np.testing.assert_allclose(BASIS.T @ found, 0.0, atol=1e-12)
    rest = own - BASIS @ (BASIS.T @ own)
    np.testing.assert_allclose(rest - found @ (found.T @ rest), 0.0, atol=1e-8)
