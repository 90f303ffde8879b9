"""What is remembered changes no prediction: not that of a run with other samples, and not by what was asked before."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.predictor import Predictor, predict
from identification.physics.load_cell_saturation import LoadCellSaturation
from identification.physics.motor_lag import MotorLag
from identification.physics.term import Scale
from identification.run_history.history import History

LIMIT = 50.0
SCALE = Scale(12.0, "V", 72.0, 300.0, 0.01, reading=60.0)


def sampled(std, seed=0):
    """Levels of 3 s with 100 samples/s, whose readings scatter by `std` N."""
    rng = np.random.default_rng(seed)
    driver = np.repeat(rng.choice((-12.0, -10.0, -4.0, 0.0, 5.0, 9.0, 11.0, 12.0), 100), 3)
    edges = np.arange(driver.size + 1.0)
    time = np.arange(0.0, edges[-1], 0.01) + 0.005
    force = (0.5 * driver * np.abs(driver))[time.astype(int)] + std * rng.standard_normal(time.size)
    count = np.full(driver.size, 100)
    mean = force.reshape(-1, 100).mean(axis=1)
    return History(
        *("made", "command_voltage", edges, driver, mean, count, edges[:-1] + 0.5, np.zeros(driver.size)),
        sample_time=time,
        sample_thrust=force,
    )


def predicted(predictor, history, term, *values):
    return predict(Model((term,)), Theta(0.5, (values,), (0.0,)), predictor.run(history), SCALE)[0]


def test_a_run_whose_samples_were_replaced_has_nothing_of_the_one_before():
    """What clips depends on how the samples scatter: lines taken out of them change it."""
    predictor, loud, quiet = Predictor(), sampled(6.0), sampled(0.5)
    clips = LoadCellSaturation("hard")
    before = predicted(predictor, loud, clips, LIMIT)
    calmer = replace(loud, thrust=quiet.thrust, sample_thrust=quiet.sample_thrust)
    after = predicted(predictor, calmer, clips, LIMIT)
    assert np.array_equal(after, predicted(Predictor(), calmer, clips, LIMIT))
    assert np.max(np.abs(after - before)) > 0.1, "or there was nothing to see"


@pytest.mark.parametrize("form", ["first_order", "quadratic", "mixed", "coasting"])
def test_predictions_do_not_depend_on_what_was_predicted_before(form):
    history, rest = sampled(1.0), {"mixed": (0.3,), "coasting": (0.3, 0.8)}.get(form, ())
    lag, constants = MotorLag(form), (0.02, 0.9, 0.1, 0.35)
    one, other = Predictor(), Predictor()
    forwards = {tau: predicted(one, history, lag, tau, *rest) for tau in constants}
    backwards = {tau: predicted(other, history, lag, tau, *rest) for tau in reversed(constants)}
    for tau in constants:
        assert np.array_equal(forwards[tau], backwards[tau])


def test_what_is_asked_for_again_is_not_made_again():
    predictor, history, clips = Predictor(), sampled(1.0), LoadCellSaturation("hard")
    assert predicted(predictor, history, clips, LIMIT) is predicted(predictor, history, clips, LIMIT)


def test_much_is_forgotten_and_nothing_changes():
    predictor, first = Predictor(), sampled(1.0)
    lag = MotorLag("quadratic")
    before = predicted(predictor, first, lag, 0.2)
    for tau in np.linspace(0.1, 0.9, 500):
        predicted(predictor, first, lag, float(tau))
    for _ in range(70):
        predictor.run(replace(first))
    assert np.array_equal(predicted(predictor, first, lag, 0.2), before)
