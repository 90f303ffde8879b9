"""What a model leaves over a covariate: what the model follows anyway is no structure, however it is scaled."""

import numpy as np

from identification.mismatch.estimate.estimate import forces
from identification.mismatch.locate.residual_structure_test import residual_structure
from identification.mismatch.select.covariates import Covariate
from identification.mismatch.select.family_wise import beside, orthogonal_basis
from identification.mismatch.select.forward_selection import search
from tests.identification.physics.runs_on_intervals import history


def test_a_column_that_is_followed_is_no_direction():
    """Its rest is rounding; made unit it was a direction like any other, and alarmed now and then."""
    rng = np.random.default_rng(0)
    followed = rng.standard_normal((200, 3))
    basis = orthogonal_basis(followed)
    fresh = rng.standard_normal((200, 2))
    rest = beside(np.column_stack([followed @ rng.standard_normal((3, 4)), fresh]), basis)
    assert rest.shape == (200, 2)
    assert np.allclose(basis.T @ rest, 0.0, atol=1e-12)
    assert beside(followed, basis).shape == (200, 0)


def test_a_covariate_of_one_value_tells_nothing():
    """A staircase that always comes from rest has one level before: a tare and a gain, which every model follows."""
    found = search((history(n=300),), np.random.default_rng(1))
    data, estimate = found.data, found.before
    (force,) = forces(estimate.fit.model, estimate.fit.theta, data)
    columns = np.column_stack([np.ones(force.size), force])
    still = Covariate("previous_voltage", (np.zeros(force.size),), "V", (columns,), "nothing")
    left = residual_structure(estimate.fit, data, estimate.weights, np.random.default_rng(2), [still], pulsing=False)
    assert left.groups == ()
    assert left.p_value == 1.0
