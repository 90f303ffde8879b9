"""A shape without a name: told with its error, and added while it predicts."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.estimate.fitting import fit
from identification.mismatch.locate.residual_structure_test import CovariateTest, ResidualStructure
from identification.mismatch.name.naming import Check, name
from identification.mismatch.select.covariates import Covariate
from identification.mismatch.unnamed.flexible import extend
from identification.mismatch.unnamed.flexible_knots import best_over
from identification.mismatch.unnamed.flexible_shape import shape_of
from identification.mismatch.unnamed.stage import foremost_covariate
from identification.mismatch.validate.train_test_split import train_test_split
from identification.physics.dead_band import DeadBand
from tests.identification.diagnosed_runs import dead_band
from tests.identification.mismatch.small import known_noise, rng, short
from tests.identification.mismatch.unnamed.shaped_runs import wet


def test_a_shape_is_told_with_errors_that_hold_the_truth():
    data, estimate = known_noise({}, [wet(change=lambda t, V, F: F * (1 + 0.05 * np.sin(t / 12)))])
    found = best_over("time", estimate, data)
    bigger, theta = estimate.fit.more(found.term, found.start)
    fitted = fit(bigger, theta, data, estimate.weights)
    shape = shape_of(found.term, fitted, data, estimate.weights)
    (curve,) = shape.splines
    assert (shape.covariate, curve.times, curve.unit) == ("time", "gain", "1")
    truth = 0.05 * np.sin(curve.at / 12)
    off = curve.value - truth
    off = off - np.mean(off)
    assert np.mean(np.abs(off) < 3 * curve.std + 0.004) > 0.9
    for at, value, measured, std in curve.table:
        assert measured == pytest.approx(value, abs=5 * std + 0.01)
        assert low_to_high(curve.at, at)
    assert list(shape.coefficients) == [p.name for p in found.term.parameters(data.scale)]


def low_to_high(at, x):
    return at[0] <= x <= at[-1]


def test_flexible_terms_are_added_while_they_predict_what_was_not_fitted():
    """A gain that comes and goes: the held-out error falls to that of the noise."""
    data, before = known_noise({}, [wet(change=lambda t, V, F: F * (1 + 0.08 * np.sin(t / 12)))])
    split = train_test_split(before, data, ())
    found = extend(before, before, data, "time", (), split, rng(0))
    assert found is not None
    assert found.terms[0].quantity in ("time", "water_temperature", "bus_voltage")
    assert found.held < 0.8 * found.without
    assert found.estimate.fit.model.terms == found.terms
    assert found.dropped == ()
    quiet, alone = known_noise({}, [wet()])
    assert extend(alone, alone, quiet, "time", (), train_test_split(alone, quiet, ()), rng(0)) is None


def test_a_flexible_term_may_take_the_place_of_a_name_that_was_not_earned():
    """A static curve with a bump: the dead band that resembles it goes."""

    def bumped(t, V, F):
        return F * np.where(np.abs(V) == 4.0, 0.6, 1.0)

    band = DeadBand()
    data, before = known_noise({}, [short(change=bumped)])
    _, after = known_noise({band: (0.3,)}, [short(change=bumped)])
    named = [n.asked(Check("own_covariate", "it is one", "it is none")) for n in name(after, data, [])]
    found = extend(after, before, data, "command_voltage", named, train_test_split(after, data, ()), rng(0))
    assert found.dropped == (band,)
    assert found.terms[0].quantity == "command_voltage"


def structure(p, *quantities):
    groups = [CovariateTest(Covariate(q, (), "1", (), ""), 9.0, 1, p, 0.1) for q in quantities]
    return ResidualStructure(tuple(groups), p)


def test_the_covariate_at_which_it_is_left_and_else_that_of_the_doubt():
    data, after = known_noise({DeadBand(): (1.0,)}, [short(volts=dead_band(1.2))])
    unearned = name(after, data, [])
    assert foremost_covariate(structure(1e-9, "time", "command_voltage"), unearned, data) == "time"
    assert foremost_covariate(structure(0.5, "time", "command_voltage"), unearned, data) == "command_voltage"
    assert foremost_covariate(structure(0.5, "time", "direction"), unearned, data) == "time"
