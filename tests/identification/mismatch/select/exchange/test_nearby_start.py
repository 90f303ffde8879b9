"""One term in the place of another, and the same effects in the forms that fit best."""

import numpy as np

from identification.mismatch.estimate.estimate import fit_without
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.select.exchange.nearby_start import best_forms, nearer
from identification.mismatch.select.exchange.rivals import swaps
from identification.physics.asymmetry import Asymmetry
from identification.physics.catalogue import CATALOGUE
from identification.physics.dead_band import DeadBand
from identification.physics.motor_lag import MotorLag
from identification.physics.recirculation import Recirculation
from identification.physics.torque_crosstalk import TorqueCrosstalk
from tests.identification.diagnosed_runs import C, dead_band
from tests.identification.mismatch.small import estimated, known_noise, short

JUMP, SHRINK = DeadBand("jump"), DeadBand("shrink")
LAGS = {MotorLag("first_order"): (), MotorLag("quadratic"): (), MotorLag("mixed"): (0.5,)}


def test_a_form_that_was_taken_for_another_is_put_right():
    data, estimate = estimated({JUMP: (1.5,)}, [short(volts=dead_band(1.5))])
    better = best_forms(estimate.fit, CATALOGUE, data, estimate.weights, estimate.noise)
    ((term, (width,)),) = better.values.items()
    assert term == SHRINK
    assert abs(width - 1.5) < 0.1
    assert better.chi2 < estimate.fit.chi2 - 100
    again = best_forms(better, CATALOGUE, data, estimate.weights, estimate.noise)
    assert again is better, "the best form stays"


def test_a_better_form_does_not_keep_the_best_from_being_asked():
    """A rotor that water and bearings brake: quadratic is better than first order, and mixed than that. A cell that
    clipped before its amplifier's noise, by 0.7 of chi-square, kept one that clips each conversion from its 270."""

    def turns(t, V, _F):
        x = np.zeros_like(V)
        for i in range(1, t.size):
            x[i] = x[i - 1]
            for _ in range(20):
                x[i] += (t[i] - t[i - 1]) / 20 * (V[i] - x[i] + 0.15 * (V[i] * abs(V[i]) - x[i] * abs(x[i])))
        return C * x * np.abs(x)

    run = short(turns, rate=25.0)
    forms = {form: known_noise({form: (0.3, *rest)}, [run])[1].fit.chi2 for form, rest in LAGS.items()}
    first, quadratic, mixed = forms.values()
    assert first > quadratic + 1000 > mixed + 2000
    data, estimate = known_noise({MotorLag("first_order"): (0.3,)}, [run])
    better = best_forms(estimate.fit, tuple(LAGS), data, estimate.weights, estimate.noise)
    assert [term.form for term in better.model.terms] == ["mixed"]
    assert better.chi2 < mixed + 1


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


def test_a_rival_is_judged_beside_the_forms_that_suit_it():
    """The jet of a weaker direction goes by the rate; beside a cross-talk of the same curve it seems to go by the
    thrust, and the asymmetry by itself does worse there."""

    def uneven_and_round(t, V, F):
        jet = np.zeros_like(V)
        for i in range(1, t.size):
            jet[i] = jet[i - 1] + (1 - np.exp(-(t[i] - t[i - 1]) / 6.0)) * (V[i - 1] - jet[i - 1])
        return np.where(F < 0, 0.94, 1.0) * F - 0.1 * C * np.abs(V) * jet

    uneven, cell = Asymmetry(), TorqueCrosstalk()
    by_rate, by_thrust = Recirculation("rate"), Recirculation("thrust")
    made = short(change=uneven_and_round, noise=0.02)
    data, estimate = known_noise({cell: (0.015,), by_thrust: (0.05, 6.0)}, [made], std=0.02)
    less = fit_without(estimate, cell, data)
    alone = swaps(estimate, cell, less, data, (uneven, cell))
    beside = swaps(estimate, cell, less, data, (uneven, cell, by_rate, by_thrust))
    assert by_rate in beside[0].fit.model.terms
    assert beside[0].term == alone[0].term == uneven
    assert alone[0].bic_loss > 45
    assert abs(beside[0].bic_loss) < 0.1, "the same curve, so neither is better"
