"""A force of any shape over one covariate: found where it acts, of the size that it has, and carried to other runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch import policy
from identification.mismatch.vehicle.fitting import Fit
from identification.mismatch.vehicle.free_force import (
    Covariate,
    FreeForce,
    Structure,
    carried,
    covariates,
    free_columns,
    free_force_of,
    judge_left,
    over,
    place_of,
    with_free_force,
)
from identification.mismatch.vehicle.model import predict, with_term
from identification.mismatch.vehicle.runs import Prepared
from identification.mismatch.vehicle.search import State
from identification.physics.vehicle.buoyancy_offset import BuoyancyOffset
from identification.physics.vehicle.term import Body
from tests.identification.mismatch.vehicle.boats import boat, orders, part, prepared, state, thrust, weak_at_8


@pytest.fixture(scope="module")
def clean() -> tuple[Prepared, State]:
    data = prepared([boat(i, levels=levels) for i, levels in enumerate(orders(2))])
    return data, state(data)


@pytest.fixture(scope="module")
def weak() -> tuple[Prepared, State]:
    """Two runs in which 8 V gives 20 N less than 25.6 N, and a third to predict."""
    data = prepared([boat(i, weak_at_8, levels) for i, levels in enumerate(orders(3))])
    return data, state(part(data, 0, 1))


def test_covariates_are_those_that_were_recorded_and_vary(clean: tuple[Prepared, State]) -> None:
    data, found = clean
    assert [c.quantity for c in covariates(found.fit, data)] == ["speed", "command_voltage", "time", "run"]
    alone = part(data, 0)
    assert [c.quantity for c in covariates(state(alone).fit, alone)] == ["speed", "command_voltage", "time"]
    for c in covariates(found.fit, data):
        assert [v.size for v in c.values] == [run.steps for run in data.runs]


def test_triangles_add_up_to_one_and_are_nought_where_nothing_is_known() -> None:
    knots = np.array([-2.0, 0.0, 1.0])
    bumps = Covariate("speed", "m/s", (np.array([-3.0, -1.0, 0.25, 5.0, np.nan]),), knots, "").bumps(0)
    assert bumps.tolist() == [[1, 0, 0], [0.5, 0.5, 0], [0, 0.75, 0.25], [0, 0, 1], [0, 0, 0]]


def test_columns_are_what_a_small_force_at_each_knot_changes_of_the_measurement(clean: tuple[Prepared, State]) -> None:
    data, found = clean
    speed = covariates(found.fit, data)[0]
    columns = free_columns(found.fit, data, speed)
    term, small = over(speed, data), 1e-3
    for i in range(speed.knots.size):
        values = small * np.eye(speed.knots.size)[i]
        layout, theta = with_term(found.fit.layout, data, found.fit.theta, term, values.tolist())
        for j, motion in enumerate(found.fit.motions):
            moved = predict(layout, theta, data, j, motion, slopes=False).response
            change = (moved - found.fit.predicted[j]) / small
            assert columns[j][:, i] == pytest.approx(change, abs=1e-3 * np.abs(change).max())


def test_of_a_model_that_is_right_nothing_is_left(clean: tuple[Prepared, State]) -> None:
    data, found = clean
    left = judge_left(found.fit, found.white, data, np.random.default_rng(0))
    assert left.p_value > 0.02
    assert [s.p_value for s in left.structures] == sorted(s.p_value for s in left.structures)
    assert all(0.0 <= s.share < 0.05 for s in left.structures)


def test_a_force_that_no_term_has_is_found_over_what_it_goes_with(weak: tuple[Prepared, State]) -> None:
    data, found = weak
    left = judge_left(found.fit, found.white, part(data, 0, 1), np.random.default_rng(0))
    assert left.p_value < policy.locate.RESIDUAL_FALSE_ALARM
    foremost = left.structures[0]
    assert foremost.covariate.quantity == "command_voltage"
    assert foremost.share > 0.5
    assert foremost.force.mean() == pytest.approx(0.0, abs=1e-9)
    place = place_of(foremost)
    assert place.low <= 8.0 <= place.high


def test_as_a_term_it_has_the_size_of_what_was_left_out(weak: tuple[Prepared, State]) -> None:
    """Knots stand at levels, where the command was: the dent of 20 N at 8 V shows against its neighbours."""
    data, found = weak
    both = part(data, 0, 1)
    left = judge_left(found.fit, found.white, both, np.random.default_rng(0))
    better = with_free_force(found, both, left.structures[0])
    assert better.fit.chi2 < 0.2 * found.fit.chi2
    term = free_force_of(better.fit.layout)
    assert term is not None
    force = dict(zip(term.knots.tolist(), better.fit.values[term], strict=True))
    lower, upper = max(k for k in force if k < 8.0), min(k for k in force if k > 8.0)
    between = np.interp(8.0, [lower, upper], [force[lower], force[upper]])
    assert force[8.0] - between == pytest.approx(-20.0, abs=2.0)


def test_beside_a_steady_force_one_knot_is_the_reference(clean: tuple[Prepared, State]) -> None:
    data, found = clean
    speed = covariates(found.fit, data)[0]
    steady = state(data, {BuoyancyOffset(): (1.0,)})
    structure = Structure(speed, 1e-9, 0.5, np.ones(speed.knots.size), np.ones(speed.knots.size), np.ones(1))
    term = free_force_of(with_free_force(steady, data, structure).fit.layout)
    assert term is not None
    assert term.knots.size == speed.knots.size - 1 == len(term.parameters(data.scale))
    assert speed.knots[term.reference] not in term.knots
    assert free_force_of(found.fit.layout) is None


def test_it_acts_on_the_body_alone_and_says_how_large_it_is(clean: tuple[Prepared, State]) -> None:
    data, found = clean
    speed = covariates(found.fit, data)[0]
    term, theta = over(speed, data), tuple(range(speed.knots.size))
    moment = data.runs[1].moment
    body = term.on_body(Body(1.0, steady=2.0), moment, theta)
    assert body.steady == pytest.approx(2.0 + np.interp(speed.values[1], speed.knots, theta))
    stranger = Body(1.0)
    assert term.on_body(stranger, replace(moment, run="another"), theta) is stranger
    assert term.on_volts(moment.volts, moment, theta) is moment.volts
    assert f"up to {theta[-1]} N" in term.statement(theta, data.scale)


def test_over_the_command_it_is_laid_on_other_runs_and_over_time_it_is_not(weak: tuple[Prepared, State]) -> None:
    data, found = weak
    both, unseen = part(data, 0, 1), part(data, 2)
    other: Fit = state(unseen).fit
    volts = next(c for c in covariates(found.fit, both) if c.quantity == "command_voltage")
    time = next(c for c in covariates(found.fit, both) if c.quantity == "time")
    laid: list[FreeForce] = []
    for covariate in (volts, time):
        term = over(covariate, both)
        layout, _ = with_term(found.fit.layout, both, found.fit.theta, term, [0.0] * term.knots.size)
        moved = free_force_of(carried(layout, term, other, unseen))
        assert moved is not None
        assert moved.knots.tolist() == term.knots.tolist(), "the same parameters"
        laid.append(moved)
    assert list(laid[0].bumps) == ["boat-2"]
    command = unseen.runs[0].moment.volts[0].mean(axis=1)
    assert laid[0].bumps["boat-2"] @ volts.knots == pytest.approx(np.clip(command, volts.knots[0], volts.knots[-1]))
    assert dict(laid[1].bumps) == {}


def test_a_place_reaches_from_knot_to_knot_and_of_runs_it_is_one() -> None:
    knots = np.array([0.0, 1.0, 3.0, 6.0])
    made = Structure(
        Covariate("speed", "m/s", (), knots, ""), 0.1, 0.1, np.array([1.0, 4.0, -9.0, 2.0]), np.full(4, 0.5), knots
    )
    assert (place_of(made).low, place_of(made).high) == (1.0, 6.0)
    assert place_of(made).table[2] == (3.0, -9.0, 0.5)
    unsure = replace(made, std=np.array([0.5, 0.5, 50.0, 0.5]))
    assert (place_of(unsure).low, place_of(unsure).high) == (0.0, 3.0)
    by_run = replace(made, covariate=replace(made.covariate, quantity="run"))
    assert (place_of(by_run).low, place_of(by_run).high) == (3.0, 3.0)


def test_a_force_of_one_run_shows_from_run_to_run() -> None:
    """A steady pull in the second of three."""
    pulled = [lambda t, V, v, pull=pull: thrust(t, V, v) - pull for pull in (0.0, 8.0, 0.0)]
    data = prepared([boat(i, push, levels) for i, (push, levels) in enumerate(zip(pulled, orders(3), strict=True))])
    found = state(data)
    left = judge_left(found.fit, found.white, data, np.random.default_rng(0))
    foremost = left.structures[0]
    assert (foremost.covariate.quantity, place_of(foremost).low) == ("run", 2.0)
    assert foremost.force[1] - foremost.force[[0, 2]].mean() == pytest.approx(-8.0, abs=1.5)
