"""C where rivals stand beside the model told: its interval is that of all of them, by their odds."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from identification.mismatch import policy
from identification.mismatch.answer.averaged_constant import averaged, quantile
from identification.mismatch.answer.report_assembly import values_of
from identification.mismatch.name.named_term import named_term
from identification.mismatch.select.stepwise import RivalTerm
from tests.identification.mismatch.small import known_noise, short
from tests.identification.physics.one_term import term

ASYMMETRY, CROSSTALK = term("asymmetry"), term("torque_crosstalk")
RATE, THRUST = term("recirculation", "rate"), term("recirculation", "thrust")


def weak_reverse(t, V, F):
    return np.where(V < 0, 0.9 * F, F)


@pytest.fixture(scope="module")
def two_names():
    """One curve, told as either effect: C of the one is that of the one side, of the other the mean of both."""
    runs = [short(weak_reverse)]
    data, one = known_noise({ASYMMETRY: (0.9,)}, runs)
    return data, one.fit, known_noise({CROSSTALK: (0.02,)}, runs)[1].fit, known_noise({}, runs)[1].fit


def told(fitted, named, other, rival, less, loss):
    stands = less, [RivalTerm(rival, other, loss, loss)]
    return named_term(named, fitted, stands, ())


def test_without_a_rival_within_reach_it_is_that_of_the_fit(two_names):
    data, one, other, less = two_names
    C = values_of(one, data)["C"]
    assert averaged(C, one, data, ()) == (C, ())
    far = told(one, ASYMMETRY, other, CROSSTALK, less, policy.select.RIVAL_STATED_BIC + 1)
    assert averaged(C, one, data, [far]) == (C, ())


def test_a_rival_that_is_rarely_met_is_said_and_hardly_widens_it(two_names):
    data, one, other, less = two_names
    C = values_of(one, data)["C"]
    found, said = averaged(C, one, data, [told(one, ASYMMETRY, other, CROSSTALK, less, 0.0)])
    assert found.value == C.value
    assert C.std < found.std < 1.5 * C.std
    assert not found.interval[0] <= other.theta.C <= found.interval[1]
    assert f"C would be {other.theta.C:.4g} N/V^2" in said[0]
    assert "does not reach so far" in said[0]


def test_the_interval_of_the_rare_one_holds_the_ordinary_one(two_names):
    data, one, other, less = two_names
    C = values_of(other, data)["C"]
    found, said = averaged(C, other, data, [told(other, CROSSTALK, one, ASYMMETRY, less, 0.0)])
    assert found.value == C.value
    assert found.interval[0] <= C.value
    assert found.interval[0] <= one.theta.C <= found.interval[1]
    assert found.std == pytest.approx(max(found.value - found.interval[0], found.interval[1] - found.value) / 1.959964)
    assert said == (
        f"With asymmetry in the place of torque crosstalk, which the recordings do not rule out, C would be "
        f"{one.theta.C:.4g} N/V^2: its interval holds both.",
    )


@pytest.mark.parametrize("loss", [0.0, 2.0, 5.0, 8.9])
def test_another_form_counts_by_its_odds(two_names, loss):
    """By the law of the mixture of scipy; what the model told has alone is never made narrower."""
    data, one, other, less = two_names
    C = values_of(one, data)["C"]
    named = replace(told(one, ASYMMETRY, other, CROSSTALK, less, 99.0), term=RATE)
    named = replace(named, forms=(RivalTerm(THRUST, other, loss, loss),))
    found, said = averaged(C, one, data, [named])
    odds = np.array([1.0, np.exp(-loss / 2)])
    low, high = found.interval
    assert low <= C.interval[0]
    assert high >= C.interval[1]
    below = norm.cdf(low, [C.value, other.theta.C], [C.std, other.std[0]]) @ odds / odds.sum()
    assert below == pytest.approx(0.025, abs=1e-6) if low < C.interval[0] else below < 0.025 + 1e-6
    assert "With recirculation (thrust) in the place of recirculation (rate)" in said[0]


def test_a_quantile_of_one_law_is_its_own():
    assert quantile(np.array([3.0]), np.array([2.0]), np.array([1.0]), 0.9) == pytest.approx(norm.ppf(0.9, 3.0, 2.0))
