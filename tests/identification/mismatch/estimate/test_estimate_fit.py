"""The fit beside scipy on a prediction written anew: values, errors, bounds, and a term taken out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from identification.mismatch.estimate.at_bounds import at_bound
from identification.mismatch.estimate.estimate import curves, fit_without, reading_step, refresh, unweighted
from identification.mismatch.estimate.fitting import bounds_of, columns_of, fit, residual_of
from identification.mismatch.model.data import PriorPredictionFactor, price
from identification.mismatch.model.model import Model
from identification.physics.asymmetry import Asymmetry
from identification.physics.dead_band import DeadBand
from identification.physics.exponent import Exponent
from identification.physics.load_cell_saturation import LoadCellSaturation
from identification.physics.motor_lag import MotorLag
from identification.physics.time_skew import TimeSkew
from identification.physics.zero_offset import ZeroOffset
from identification.recording import Channel
from tests.identification.diagnosed_runs import NOISE, TOP, C, dead_band, levels, table
from tests.identification.mismatch.small import (
    data_of,
    estimated,
    known_noise,
    placed,
    rng,
    short,
    white,
)

BAND, UNEVEN, JUMP = DeadBand(), Asymmetry(), ZeroOffset()


def curve(p, volts):
    """A dead band and another gain in reverse: the textbook's static curve."""
    constant, width, ratio = p
    x = np.sign(volts) * np.maximum(np.abs(volts) - width, 0.0)
    return constant * x * np.abs(x) * np.where(x < 0, ratio, 1.0)


def both(seed=0):
    return short(lambda _t, _V, F: np.where(F < 0, 0.85, 1.0) * F, volts=dead_band(1.5), seed=seed, tare=seed + 1.0)


@pytest.fixture(scope="module")
def fitted():
    """Two runs of a dead band and an asymmetry, beside the noise that was put in."""
    return known_noise({BAND: (1.0,), UNEVEN: (1.0,)}, [both(0), both(1)])


def test_values_and_errors_are_those_of_scipy(fitted):
    """Weighted least squares of C, both parameters and a tare for each run, on a prediction that shares no code."""
    data, estimate = fitted
    rows = list(zip(data.histories, data.rows, strict=True))

    def residual(p):
        left = [
            (h.thrust[r] - curve(p[:3], h.driver[r]) - p[3 + i]) * np.sqrt(h.count[r]) / NOISE
            for i, (h, r) in enumerate(rows)
        ]
        return np.concatenate(left)

    theirs = least_squares(residual, [0.4, 0.5, 1.0, 0.0, 0.0], xtol=1e-14, ftol=1e-14)
    now = estimate.fit
    ours = [now.theta.C, *now.values[BAND], *now.values[UNEVEN], *now.theta.tares]
    assert now.chi2 == pytest.approx(2 * theirs.cost, rel=1e-6)
    std = np.sqrt(np.diag(np.linalg.inv(theirs.jac.T @ theirs.jac)))
    assert np.all(np.abs(ours - theirs.x) < 0.02 * std)
    at = now.layout
    places = [at.C, at.of(BAND).start, at.of(UNEVEN).start, at.tare(0), at.tare(1)]
    assert now.std[places] == pytest.approx(std, rel=0.01)
    assert np.all(np.abs(theirs.x - [C, 1.5, 0.85, 1.0, 2.0]) < 4 * std)


def test_chi_square_is_the_number_of_rows_less_what_was_fitted(fitted):
    """To five standard deviations: the noise that was put in is the noise that is left."""
    _, estimate = fitted
    n = estimate.fit.residual.size - int(estimate.fit.free.sum())
    assert abs(estimate.fit.chi2 - n) < 5 * np.sqrt(2 * n)
    expected = estimate.fit.chi2 + estimate.fit.log_det + 5 * np.log(estimate.fit.residual.size)
    assert estimate.bic == pytest.approx(expected)


@pytest.mark.parametrize("begin", [(0.2, 0.5), (3.0, 2.0)])
def test_where_it_begins_does_not_matter(fitted, begin):
    data, estimate = fitted
    model, theta = placed({BAND: begin[:1], UNEVEN: begin[1:]}, estimate.fit.theta)
    again = fit(model, replace(theta, C=0.3, tares=(9.0, -9.0)), data, estimate.weights)
    assert again.chi2 == pytest.approx(estimate.fit.chi2, abs=0.01)


def test_it_stays_within_physical_bounds():
    """Thrust that grows faster than the square with no dead band: the width would be negative."""
    data, estimate = known_noise({BAND: (1.0,)}, [short(volts=lambda V: V + np.sign(V) * (V != 0))])
    low, high, _ = bounds_of(estimate.fit.model, data, estimate.fit.theta)
    (width,) = estimate.fit.values[BAND]
    assert width == 0.0 == low[1]
    assert width < high[1]
    assert not estimate.fit.free[1], "it has no standard error there"
    assert np.isnan(estimate.fit.std[1])
    assert at_bound(BAND, estimate.fit, data, estimate.weights) is False, "no dead band is what 0 means"


def test_a_value_pressed_against_its_end_is_told():
    """More torque than a catalogue allows, less than half of it backwards than any propeller gives."""
    data, estimate = known_noise({Exponent(): (2.0,)}, [short(volts=lambda V: np.sign(V) * np.abs(V) ** 3 / TOP**2)])
    low, high, _ = bounds_of(estimate.fit.model, data, estimate.fit.theta)
    assert estimate.fit.theta.terms[0][0] in (low[1], high[1])
    assert at_bound(Exponent(), estimate.fit, data, estimate.weights)


def test_without_a_term_it_is_the_fit_of_the_smaller_model(fitted):
    data, estimate = fitted
    less = fit_without(estimate, UNEVEN, data)
    assert less.model == Model((BAND,))
    smaller, theta = placed({BAND: (1.0,)}, estimate.fit.theta)
    alone = fit(smaller, theta, data, estimate.weights)
    assert less.chi2 == pytest.approx(alone.chi2, abs=0.01)
    assert less.chi2 > estimate.fit.chi2 + 1000
    assert fit_without(estimate, UNEVEN, data) is less, "asked for by many, made once"


def test_a_hopeless_fit_ends_early():
    data, theta = data_of([both()])
    model, begin = placed({JUMP: (0.1, 20.0)}, theta)
    w = white(data, model, begin)
    whole = fit(model, begin, data, w)
    early = fit(model, begin, data, w, hopeless=1.0)
    assert early.chi2 >= whole.chi2 > 1.0


def test_clocks_that_differ_are_a_nuisance_within_their_bound():
    """The force comes 0.4 ms late; a millisecond is allowed, and beside a term that delays none is needed."""
    late = short(lambda t, _V, F: np.interp(t - 0.004, t, F), rate=40.0)
    data, estimate = estimated({}, [late], clocks=True)
    assert 0 < data.most_shift <= 0.01
    at = estimate.fit.layout.shift
    low, high, _ = bounds_of(estimate.fit.model, data, estimate.fit.theta)
    assert (low[at], high[at]) == (-data.most_shift, data.most_shift)
    skew = TimeSkew()
    model, theta = placed({skew: (0.01,)}, estimate.fit.theta)
    low, high, _ = bounds_of(model, data, theta)
    assert low[model.layout(theta).shift] == high[model.layout(theta).shift] == 0.0
    assert price(skew, data) == len(skew.parameters(data.scale)) - 1
    assert price(BAND, data) == 1


def test_the_residual_is_measured_less_predicted_over_the_noise(fitted):
    data, estimate = fitted
    theta = replace(estimate.fit.theta, terms=((0.0,), (1.0,)), C=0.0, tares=(0.0, 0.0))
    bare = residual_of(estimate.fit.model, theta, data, unweighted(data))
    assert bare == pytest.approx(np.concatenate(data.thrust))


def test_the_slopes_of_the_rate_alone_are_those_of_the_whole_prediction():
    """Its scale and its clock, beside a difference of residuals; the thrust's rows have none of it."""
    t = np.arange(0.0, 80.0, 0.02)
    start, level = levels(0, 80.0)
    command = level[np.maximum(np.searchsorted(start, t, side="right") - 1, 0)]
    turns = Channel(
        "rotation_rate", "esc", "rotation_rate", "rev/s", t, 2.5 * command + 0.01 * rng(1).normal(size=t.size)
    )
    data, estimate = estimated({MotorLag("first_order"): (0.3,)}, [short(extra=(turns,), rate=40.0)], clocks=True)
    assert data.with_rate
    model, theta = estimate.fit.model, replace(estimate.fit.theta, rate_shift=0.3 * data.most_shift)
    at = model.layout(theta)
    for j, part in ((at.k, 1e-3), (at.rate_shift, 1e-4)):
        which = np.arange(at.size) == j
        (slope,) = columns_of(model, theta, data, estimate.weights, which).T
        moved = theta.with_part(which, theta.vector[which] + part)
        change = residual_of(model, theta, data, estimate.weights) - residual_of(model, moved, data, estimate.weights)
        assert np.linalg.norm(slope) > 1.0
        assert not slope[: data.size].any()
        assert slope == pytest.approx(change / part, abs=1e-6 * np.abs(slope).max())


# ---------------------------------------------------------------- noise with the fit


def test_noise_is_estimated_beside_what_was_fitted_and_kept_where_asked():
    data, theta = data_of([both()])
    model, begin = placed({BAND: (1.0,), UNEVEN: (1.0,)}, theta)
    found = refresh(model, begin, data, None, None)
    assert np.sqrt(found.noise.white + sum(found.noise.slow)) == pytest.approx(NOISE, rel=0.1)
    worse = refresh(Model(), theta, data, None, None)
    assert worse.noise.white + sum(worse.noise.slow) > 4 * NOISE**2, "what a model lacks is noise to it"
    like = refresh(model, begin, data, None, None, found.noise)
    assert like.noise.scales == found.noise.scales
    assert like.fit.deviance == pytest.approx(found.fit.deviance, abs=0.5)


def test_columns_taken_as_fitted_take_their_share_of_the_residual():
    """A sine in the reading beside a column of the same shape is no noise."""
    data, theta = data_of([short(lambda t, _V, F: F + 2.0 * np.sin(t))])
    rows = data.histories[0].sampled[data.rows[0]]
    column = np.column_stack([np.sin(rows), np.cos(rows)])
    plain, beside = (refresh(Model(), theta, data, extra, None).noise for extra in (None, column))
    assert plain.white + sum(plain.slow) > 1.0
    assert beside.white + sum(beside.slow) == pytest.approx(NOISE**2, rel=0.25)


def test_what_a_given_baseline_is_not_sure_of_is_no_noise_of_the_rate():
    """Six rows beside a threshold made the noise of all of them sixteen times what it was."""
    begun, level = levels(0, 80.0)
    t = np.arange(0.0, 80.0, 1 / 8.0) + 0.03
    rate = 3.0 * level[np.maximum(np.searchsorted(begun, t, side="right") - 1, 0)] + 0.02 * rng().standard_normal(
        t.size
    )
    rate[50::100] += 1.5
    data, theta = data_of([short(extra=(Channel("rotation_rate", "drive", "rotation_rate", "rev/s", t, rate),))])
    (h,) = data.histories
    gap = h.rates - 3.0 * h.driver[h.rate_rows]
    beside = np.where(np.abs(gap) > 0.3, gap, 0.0)[:, None]
    assert np.count_nonzero(beside) == 6
    spread = PriorPredictionFactor((np.zeros((data.thrust[0].size, 1)),), (beside,))
    begin = replace(theta, k=3.0)
    blind, sure = (refresh(Model(), begin, d, None, None) for d in (data, replace(data, twin_factor=spread)))
    loud, quiet = (each.rate_noise.white + sum(each.rate_noise.slow) for each in (blind, sure))
    assert loud > 20 * 0.02**2
    assert quiet == pytest.approx(0.02**2, rel=0.15)


def test_nor_of_the_thrust():
    """A drift of 15 sigma was slow noise beside a recirculation that the twin knew to a twentieth."""
    data, theta = data_of([short(lambda t, _V, F: F + 1.0 * np.sin(0.2 * t))])
    rows = data.histories[0].sampled[data.rows[0]]
    spread = PriorPredictionFactor((np.sin(0.2 * rows)[:, None],), (np.zeros((0, 1)),))
    blind, sure = (refresh(Model(), theta, d, None, None) for d in (data, replace(data, twin_factor=spread)))
    assert sum(blind.noise.slow) > 0.1
    assert sure.noise.white + sum(sure.noise.slow) == pytest.approx(NOISE**2, rel=0.25)
    half = [np.arange(rows.size) < rows.size // 2]
    some = replace(data, twin_factor=spread, keep=tuple(half))
    assert refresh(Model(), theta, some, None, None).noise.white == pytest.approx(NOISE**2, rel=0.3)


def test_rounding_of_a_table_is_noise_too():
    values = np.round(rng(2).normal(size=50), 2)
    assert reading_step(values) == pytest.approx(0.01)
    assert reading_step(np.zeros(4)) == 0.0
    rounded = table(lambda v: np.round(C * v * np.abs(v)), number=161, noise=0.0)
    data, theta = data_of([rounded])
    found = refresh(Model(), theta, data, None, None)
    assert 1 / 12 <= found.noise.white < 0.2
    assert found.noise.slow == ()


def test_a_smooth_curve_of_a_table_is_within_its_columns():
    data, _ = data_of([table(lambda v: C * v * np.abs(v))])
    h = data.histories[0]
    turning = replace(data, histories=(replace(h, rate=2.0 * h.driver, rate_count=np.ones(h.driver.size, int)),))
    (columns,) = curves(turning)
    volts = h.driver
    left = volts**3 - columns @ np.linalg.lstsq(columns, volts**3, rcond=None)[0]
    assert np.std(left) < 0.02 * np.std(volts**3)


def test_a_form_of_a_limit_lies_where_readings_end():
    """Clipped at 40 N: the fit finds the limit from above it."""
    clips = LoadCellSaturation("hard")
    clipped = short()
    command, thrust = clipped.channels
    clipped = replace(clipped, channels=(command, replace(thrust, value=np.clip(thrust.value, -40.0, 40.0))))
    _, estimate = known_noise({clips: (45.0,)}, [clipped])
    assert estimate.fit.values[clips][0] == pytest.approx(40.0, abs=0.2)
