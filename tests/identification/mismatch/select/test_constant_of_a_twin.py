"""Against a twin C is known: of two effects that do as well the one that leaves C as it was needs one change less."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.answer.against_twin import twin_of
from identification.mismatch.compare.saved_model_baseline import starting
from identification.mismatch.estimate.estimate import refresh
from identification.mismatch.model.model import extended
from identification.mismatch.select.exchange.rivals import constant_moved
from identification.mismatch.select.forward_selection import Thruster
from identification.mismatch.select.stepwise import exchanged
from identification.physics.asymmetry import Asymmetry
from identification.physics.exponent import Exponent
from identification.physics.torque_crosstalk import TorqueCrosstalk
from tests.identification.diagnosed_runs import C
from tests.identification.mismatch.small import data_of, known_noise, short

UNEVEN, TWIST, POWER = Asymmetry(), TorqueCrosstalk(), Exponent()


def twisted(_time, volts, force):
    """The same sign in both directions: 2 % of C V^2."""
    return force + 0.02 * C * volts**2


@pytest.fixture(scope="module")
def against():
    """A run with cross-talk against the twin of one without, and the model with an asymmetry in its place."""
    first = short()
    data, estimate = known_noise({}, [first])
    twin = twin_of(estimate, data, [first], None)
    data, theta, model = starting(twin)(*data_of([short(change=twisted, seed=1)]))
    return data, refresh(*extended(model, theta, UNEVEN, (0.96,)), data, None, None)


def test_another_constant_costs_a_parameter_at_most(against):
    data, estimate = against
    price = np.log(estimate.fit.residual.size)
    assert constant_moved(estimate.fit, data) == pytest.approx(price), "C is 2 % more, far beyond its error"
    close = replace(data, constant_before=(estimate.fit.theta.C, 1.0))
    assert constant_moved(estimate.fit, close) == pytest.approx(0.0, abs=1e-9)
    assert constant_moved(estimate.fit, replace(data, constant_before=None)) == 0.0
    model, theta = extended(estimate.fit.model, estimate.fit.theta, POWER, (2.0,))
    assert constant_moved(replace(estimate.fit, model=model, theta=theta), data) == 0.0, "it refers C to a voltage"


def test_what_leaves_the_constant_as_it_was_is_named(against):
    data, estimate = against
    after, _ = exchanged(Thruster(data, (UNEVEN, TWIST)), estimate)
    assert [t.id for t in after.fit.model.terms] == ["torque_crosstalk"]
    alone = replace(data, constant_before=None)
    kept, _ = exchanged(Thruster(alone, (UNEVEN, TWIST)), estimate)
    assert [t.id for t in kept.fit.model.terms] == ["asymmetry"], "without a twin the ordinary one is named"
