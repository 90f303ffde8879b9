"""One term in the place of another, and the same effects in the forms that fit best."""

import numpy as np

from identification.mismatch.estimate.fitting import fit
from identification.mismatch.select.exchange.nearby_start import best_forms, nearer
from identification.physics.asymmetry import Asymmetry
from identification.physics.catalogue import CATALOGUE
from identification.physics.dead_band import DeadBand
from identification.physics.torque_crosstalk import TorqueCrosstalk
from tests.identification.diagnosed_runs import C, dead_band
from tests.identification.mismatch.small import estimated, short

JUMP, SHRINK = DeadBand("jump"), DeadBand("shrink")


def test_a_form_that_was_taken_for_another_is_put_right():
    data, estimate = estimated({JUMP: (1.5,)}, [short(volts=dead_band(1.5))])
    better = best_forms(estimate.fit, CATALOGUE, data, estimate.weights, estimate.noise)
    ((term, (width,)),) = better.values.items()
    assert term == SHRINK
    assert abs(width - 1.5) < 0.1
    assert better.chi2 < estimate.fit.chi2 - 100
    again = best_forms(better, CATALOGUE, data, estimate.weights, estimate.noise)
    assert again is better, "the best form stays"


def test_a_rival_that_is_the_same_curve_begins_where_it_does_the_same():
    uneven, cell = Asymmetry(), TorqueCrosstalk()
    made = short(change=lambda _t, _V, F: np.where(F < 0, 0.9, 1.0) * F)
    data, estimate = estimated({uneven: (0.9,)}, [made])
    less = fit(*estimate.fit.less(uneven), data, estimate.weights)
    trial = cell.trials(data.scale)[0]
    model, theta = nearer(less, estimate.fit, uneven, cell, trial, data, estimate.weights)
    ((coefficient,),) = (model.values(theta)[cell],)
    assert abs(coefficient - 0.05 * C) < 0.001, "0.95 C x|x| + 0.05 C x^2 is C x^2 one way and 0.9 C x^2 the other"
    assert abs(theta.C - 0.95 * C) < 0.001
    assert fit(model, theta, data, estimate.weights, 3).chi2 < estimate.fit.chi2 + 1
