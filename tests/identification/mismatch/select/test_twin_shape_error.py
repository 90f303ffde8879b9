"""What a twin's shapes may leave in another run before something unknown is said to be left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch import policy
from identification.mismatch.estimate.estimate import refresh
from identification.mismatch.locate.residual_structure_test import residual_structure
from identification.mismatch.model.model import Given, Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.whitening import Weights
from identification.mismatch.select.shape_error import corrections, of_twin
from identification.physics.asymmetry import Asymmetry
from tests.identification.mismatch.small import data_of, rng, short

RATIO = 0.7
QUIET = 0.002
"""N."""


def bent(by):
    """Weak in reverse, and there with a little of another curve: a share `by` of what the asymmetry takes."""

    def change(_time, volts, force):
        lost = np.where(force < 0, (1 - RATIO) * force, 0.0)
        return force - lost * (1 + by * np.sin(3 * np.abs(volts)))

    return change


def beside_a_twin(by, **how):
    data, theta = data_of([short(change=bent(by), **how)])
    given = Given(Asymmetry(), (RATIO,), data.scale)
    return data, refresh(Model((), (given,)), Theta(theta.C, (), theta.tares), data, None, None)


def test_of_a_twin_a_thirtieth_of_what_a_found_term_is_spared():
    data, estimate = beside_a_twin(0.0)
    (mine,) = of_twin(estimate.fit, data, Weights(estimate.weights.thrust))
    found = refresh(Model((Asymmetry(),)), Theta(estimate.fit.theta.C, ((RATIO,),), (0.0,)), data, None, estimate)
    (whole,) = corrections(found.fit, data, Weights(estimate.weights.thrust))
    share = policy.compare.TWIN_SHAPE_ERROR / policy.select.SHAPE_ERROR
    assert np.linalg.norm(mine) == pytest.approx(share * np.linalg.norm(whole), rel=0.02)
    assert of_twin(found.fit, data, Weights(estimate.weights.thrust)) == []


@pytest.mark.parametrize(("by", "left"), [(5e-4, False), (0.3, True)])
def test_a_part_in_a_thousand_is_not_left_and_much_more_is(by, left):
    """Both stand plainly out of the noise where no term is there to have such a shape."""
    data, estimate = beside_a_twin(by, noise=QUIET)
    judged = residual_structure(estimate.fit, data, estimate.weights, rng(0)).groups[0].p_value
    assert (judged < policy.locate.RESIDUAL_FALSE_ALARM) == left
    bare = replace(estimate.fit, model=Model())
    alone = residual_structure(bare, data, estimate.weights, rng(0)).groups[0].p_value
    assert alone < policy.locate.RESIDUAL_FALSE_ALARM
