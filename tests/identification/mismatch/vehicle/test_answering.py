"""What a vehicle's diagnosis is put together of: units, places, what is left, and what is tied by scale."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch import policy
from identification.mismatch.name.named_term import Check, NamedTerm
from identification.mismatch.vehicle.answering import (
    baseline_words,
    curves_of,
    place_of_findings,
    places_of,
    state_whiteness,
    ties,
    unexplained_of,
    values_of,
    where_of,
)
from identification.mismatch.vehicle.free_force import Covariate, Left, Structure
from identification.mismatch.vehicle.naming import Named
from identification.mismatch.vehicle.runs import Prepared
from identification.mismatch.vehicle.setup import Stated
from identification.physics.vehicle.dead_band import DeadBand
from identification.physics.vehicle.installation_efficiency import InstallationEfficiency
from tests.identification.mismatch.vehicle.boats import DRAG, HOLD, LEVELS, MASS, C, banded, boat, prepared, state

BAND, SHARE = DeadBand(), InstallationEfficiency()


@pytest.fixture(scope="module")
def data() -> Prepared:
    return prepared([boat(push=banded(1.0))], std=0.004)


def structure(quantity: str, p: float, share: float = 0.3) -> Structure:
    """A force of -9 N at the third of five knots."""
    knots = np.arange(1.0, 6.0)
    force = np.array([0.0, 1.0, -9.0, 1.0, 0.0])
    covariate = Covariate(quantity, "1" if quantity == "run" else "V", (), knots, f"a force over {quantity}")
    return Structure(covariate, p, share, force, np.ones(5), force)


PLAIN = Left(1e-12, (structure("command_voltage", 1e-14), structure("run", 1e-3), structure("time", 0.5)))
NOTHING = Left(0.4, (structure("command_voltage", 0.1), structure("time", 0.5)))


def test_the_baseline_is_written_with_the_mass_or_per_kilogramme(data: Prepared) -> None:
    assert baseline_words(data) == "m v' = -k2 |v| v + thrusters"
    assert baseline_words(prepared([boat()], None, std=10.0)).startswith("v' =")


def test_values_have_their_own_units_and_a_thruster_its_constant(data: Prepared) -> None:
    found = state(data, {BAND: (0.5,)})
    told = values_of(found.fit, data)
    assert set(told) == {"k2", "C[T1]", "dead_band.half_width"}
    assert {name: value.unit for name, value in told.items()} == {
        "k2": "N/(m/s)^2",
        "C[T1]": "N/V^2",
        "dead_band.half_width": "V",
    }
    for name, true in (("k2", DRAG), ("C[T1]", C), ("dead_band.half_width", 1.0)):
        assert abs(told[name].value - true) < 4 * told[name].std < 0.1 * true
    assert told["C[T1]"].std < 0.004, "N/V^2: the motion says more than the tunnel did"


def test_a_place_is_told_with_its_unit_and_a_run_with_its_name(data: Prepared) -> None:
    where = where_of(PLAIN.structures[0])
    assert (where.quantity, where.low, where.high, where.unit) == ("command_voltage", 2.0, 4.0, "V")
    volts, run = places_of(PLAIN, replace(data, runs=data.runs * 5), "speed")
    assert (volts.channel, volts.share, volts.p_value) == ("speed", 0.3, 1e-14)
    assert volts.statement == (
        "A force over command_voltage explains 30 % of what is left, in units of its noise, most at command_voltage "
        "2 to 4 V."
    )
    assert run.statement.endswith("most at run 3 (boat-0).")


def test_of_what_is_noise_no_place_is_told(data: Prepared) -> None:
    assert places_of(NOTHING, data, "speed") == ()
    assert unexplained_of(NOTHING, (), data) is None
    assert unexplained_of(Left(1.0, ()), (), data) is None


def doubted(term: DeadBand, why: str) -> Named:
    asked = (Check("constant", "the same in both halves", why),)
    return NamedTerm(term, (1.0,), (0.1,), 50.0, 45.0, 1e-9, 1.0, (), asked)


def test_what_is_left_stands_where_it_is_clearest_with_its_table(data: Prepared) -> None:
    left = unexplained_of(PLAIN, (), data)
    assert left is not None
    assert left.where == where_of(PLAIN.structures[0])
    assert left.shape == ((1.0, 0.0, 1.0), (2.0, 1.0, 1.0), (3.0, -9.0, 1.0), (4.0, 1.0, 1.0), (5.0, 0.0, 1.0))
    assert left.resembles == ()


def test_a_name_that_was_not_earned_is_what_is_left_over_its_own_covariate(data: Prepared) -> None:
    """Though nothing is clear, and time would stand first."""
    dim = Left(0.4, (structure("time", 0.05), structure("command_voltage", 0.1)))
    left = unexplained_of(dim, (doubted(BAND, "its parameter is not the same"),), data)
    assert left is not None
    assert left.where.quantity == "command_voltage"
    assert left.resembles == ("dead_band: its parameter is not the same",)
    assert left.statement.endswith("refused: dead band (its parameter is not the same).")


def test_findings_that_no_free_force_shows_have_the_place_where_they_act(data: Prepared) -> None:
    before, after = state(data), state(data, {BAND: (0.5,)})
    (place,) = place_of_findings(NOTHING, before, after, data, "speed")
    assert place.where.quantity == "command_voltage"
    assert place.share == pytest.approx(1 - after.fit.chi2 / before.fit.chi2)
    assert 0 < place.p_value < policy.locate.RESIDUAL_FALSE_ALARM
    assert place_of_findings(Left(1.0, ()), before, after, data, "speed") == ()


def test_what_is_left_is_white_with_the_right_model_alone(data: Prepared) -> None:
    assert state_whiteness(state(data)) < 1e-6
    assert state_whiteness(state(data, {BAND: (0.5,)})) > 0.01


def test_curves_are_of_the_samples_with_the_command_that_was_held(data: Prepared) -> None:
    before, after = state(data), state(data, {BAND: (0.5,)})
    (curve,) = curves_of(before.fit, after.fit, data)
    assert np.array_equal(curve.thrust, data.runs[0].response)
    held = np.array(LEVELS)[(curve.time / HOLD + 1e-9).astype(int)]
    assert np.mean(curve.driver == held) > 0.97
    assert np.std(curve.thrust - curve.model) < 0.5 * np.std(curve.thrust - curve.baseline)


def test_what_is_tied_goes_with_what_is_known() -> None:
    said = {}
    for what, (mass, std) in {
        "neither": (None, 10.0),
        "no mass": (None, 0.0),
        "no thrust": (Stated(MASS), 10.0),
        "both": (Stated(MASS), 0.0),
    }.items():
        one = prepared([boat()], mass, std)
        said[what] = ties(one, state(one).fit, ("unseen",))
    assert "forces are per kg of inertia" in said["neither"][0]
    assert "no mass is stated" in said["no mass"][0]
    assert "thrusters' models are not known" in said["no thrust"][0]
    assert "each is stated given the other" in said["both"][0]
    assert [("unseen" in told) for told in said.values()] == [True, True, False, False]


def test_the_share_over_the_mass_has_the_error_of_both() -> None:
    """By draws from the covariance of the two: each alone is known to 2 %, their ratio far better."""
    one = prepared([boat(push=lambda t, V, v: 0.8 * C * V * abs(V))], Stated(MASS, 0.02 * MASS))
    found = state(one, {SHARE: (0.9,)}).fit
    said = next(told for told in ties(one, found, ()) if told.startswith("what the motion shows"))
    value, error = (float(part.split()[0]) for part in said.split(" = ")[1].split(" +- "))
    names = [p.name for p in found.layout.base]
    at = [found.layout.of(SHARE).start, names.index("m")]
    draws = np.random.default_rng(1).multivariate_normal(found.theta[at], found.cov[np.ix_(at, at)], 20000)
    ratio = draws[:, 0] / draws[:, 1]
    assert value == pytest.approx(ratio.mean(), rel=1e-3)
    assert error == pytest.approx(ratio.std(), rel=0.06)
    assert value == pytest.approx(0.8 / MASS, abs=4 * error)
    assert error / value < 0.3 * found.std[at[1]] / found.theta[at[1]]
