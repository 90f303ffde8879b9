"""Heat in a winding of which no other term says what it takes: asked beside the typical one, and only there."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from identification.mismatch.answer.report_assembly import constant_of
from identification.mismatch.estimate.estimate import fit_without
from identification.mismatch.select.exchange.likeness import alike
from identification.mismatch.select.exchange.nearby_start import beginnings, best_forms, may_replace
from identification.mismatch.select.forward_selection import Thruster, available
from identification.recording import Channel, Recording
from tests.identification.diagnosed_runs import TOP, C, levels
from tests.identification.mismatch.small import known_noise
from tests.identification.physics.one_term import term

SHARE, COPPER, STD = 0.33, 0.0039, 0.05
MEASURED, OWN = term("heating", "measured_winding"), term("heating", "measured_own_winding")
SECONDS = 160.0


def warm_rate(volts, kelvin):
    """Of 1 V s per turn where a third of 12 V is lost in the cold winding and made up for: e + W (1 + c) e^2."""
    w = SHARE / ((1 - SHARE) * TOP)
    voltage = abs(volts) + w * volts**2
    if not volts:
        return 0.0
    return np.sign(volts) * brentq(lambda e: e + w * (1 + COPPER * kelvin) * e**2 - voltage, 0.0, 2 * TOP)


@pytest.fixture(scope="module")
def warming():
    """It grows warmer by 30 K, whatever it does, as a thermometer without noise sees."""
    start, level = levels(2, SECONDS)
    t = np.arange(0.05, SECONDS, 0.1)
    volts = level[np.searchsorted(start, t, side="right") - 1]
    kelvin = 30.0 * t / SECONDS
    rate = np.array([warm_rate(v, k) for v, k in zip(volts, kelvin, strict=True)])
    force = C * rate * np.abs(rate) + STD * np.random.default_rng(1).standard_normal(t.size)
    channels = (
        Channel("command", "command", "command_voltage", "V", start, level),
        Channel("thrust", "cell", "thrust", "N", t, force),
        Channel("warm", "slow", "motor_temperature", "degC", t, 18.0 + kelvin),
    )
    return Recording("warming", "T1", channels)


def test_how_the_loss_grows_tells_what_the_winding_takes(warming):
    data, estimate = known_noise({MEASURED: (0.001,)}, [warming], STD)
    better = best_forms(estimate.fit, available(data), data, estimate.weights, estimate.noise)
    ((found, (_, share)),) = better.values.items()
    assert found == OWN
    assert better.chi2 < estimate.fit.chi2 - 50
    assert abs(share - SHARE) < 3 * better.std[better.layout.of(OWN)][1] < 0.1
    off = [abs(constant_of(each, data)[0] - C) for each in (estimate.fit, better)]
    assert off[1] < 0.3 * off[0]


def test_it_begins_at_the_values_of_the_typical_one(warming):
    data, estimate = known_noise({MEASURED: (0.001,)}, [warming], STD)
    value = estimate.fit.values[MEASURED][0]
    begun = beginnings(MEASURED, (value,), OWN, data.scale)
    assert {each[0] for each in begun} == {value}
    found = alike(estimate, MEASURED, fit_without(estimate, MEASURED, data), data, available(data))
    assert found[OWN] == (1.0, begun[0])


def test_it_is_asked_only_of_heat_and_where_nothing_else_says_what_is_lost(warming):
    data, estimate = known_noise({MEASURED: (0.001,)}, [warming], STD)
    model = estimate.fit.model
    assert may_replace(MEASURED, OWN, model)
    assert not may_replace(term("dead_band"), OWN, model)
    assert not may_replace(MEASURED, OWN, model.plus(term("winding_resistance")))
    bare, terms = known_noise({}, [warming], STD)[1], available(data)
    judged = Thruster(data, terms).judged(bare, np.random.default_rng(0))
    assert MEASURED in judged.directions.terms
    assert OWN in terms
    assert OWN not in judged.directions.terms


def test_the_error_of_the_first_temperature_is_one_of_c(warming):
    """0.1 % of the thrust for each kelvin: a beginning that is unsure by one makes C so."""
    data, estimate = known_noise({MEASURED: (0.001,)}, [warming], STD)
    unsure = replace(data, scale=replace(data.scale, cold_error=1.0))
    own, both = (constant_of(estimate.fit, each)[1] for each in (data, unsure))
    assert np.sqrt(both**2 - own**2) / C == pytest.approx(estimate.fit.values[MEASURED][0], rel=0.3)
