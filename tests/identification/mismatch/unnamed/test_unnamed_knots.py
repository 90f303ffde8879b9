"""Flexible terms: their knots, their kinds, and which gains most where it was planted."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.flexible_terms.flexible import MULTIPLIERS, Flexible
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.locate.pulses import Pulses
from identification.mismatch.unnamed.flexible import foremost
from identification.mismatch.unnamed.flexible_kinds import shapes_over
from identification.mismatch.unnamed.flexible_knots import best_over, seen_at
from identification.mismatch.unnamed.spline_knot_selection import Moments, choose, heights, nodes_of
from identification.run_history.splines import spline
from tests.identification.diagnosed_runs import C
from tests.identification.mismatch.small import data_of, known_noise, rng, short
from tests.identification.mismatch.unnamed.shaped_runs import wet


def moments(x, y, noise, constant=True):
    nodes = nodes_of(x)
    hats = spline(x, nodes, np.eye(nodes.size), 1) / noise
    return Moments(nodes, hats.T @ hats, hats.T @ (y / noise), x.size, (constant,))


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 500), st.sampled_from([1, 3]))
def test_heights_at_chosen_knots_are_those_of_least_squares(seed, degree):
    """Beside a regression on the splines themselves; cubics up to the broken line between fine nodes."""
    x = np.sort(rng(seed).uniform(0, 10, 800))
    y = np.cos(x) + 0.1 * rng(seed + 1).standard_normal(x.size)
    m = moments(x, y, 0.1)
    knots = (0, 10, 25, 40, m.nodes.size - 1)
    free = [tuple(range(5))]
    basis = spline(x, m.nodes[list(knots)], np.eye(5), degree)
    direct = np.linalg.lstsq(basis, y, rcond=None)[0]
    assert heights(m, knots, degree, free) == pytest.approx(direct, abs=1e-6 if degree == 1 else 0.02)


def test_the_gain_is_the_fall_of_chi_square_less_the_price_of_its_columns():
    """A straight line takes two columns and no knots."""
    x = np.linspace(0, 10, 600)
    y = 0.3 * x + 1 + 0.1 * rng(1).standard_normal(x.size)
    m = moments(x, y, 0.1)
    found = choose(m)
    assert found.knots == (0, m.nodes.size - 1)
    X = np.column_stack([np.ones(x.size), x])
    fall = float(np.sum((y / 0.1) ** 2) - np.sum((y - X @ np.linalg.lstsq(X, y, rcond=None)[0]) ** 2) / 0.01)
    assert found.gain == pytest.approx(fall - 2 * np.log(x.size), rel=1e-6)


def test_knots_that_must_be_are_and_a_begin_is_taken_where_it_is_better():
    x = np.linspace(0, 10, 900)
    y = 0.1 * rng(2).standard_normal(x.size)
    m = moments(x, y, 0.1)
    assert 20 in choose(m, must=(20,)).knots
    bump = np.exp(-((x - 3.03) ** 2) / 0.004)
    sharp = moments(x, bump + y, 0.1)
    near = tuple(int(np.argmin(np.abs(sharp.nodes - at))) for at in (2.9, 3.03, 3.16))
    assert choose(sharp, begin=(near,)).gain >= choose(sharp).gain - 1e-9


def test_each_covariate_offers_kinds_that_may_act_over_it():
    data, _ = data_of([wet()])
    for quantity in (
        *("command_voltage", "direction", "time", "time_since_step", "previous_voltage", "direction_of_change"),
        *("load_history", "rotation_rate", "water_temperature", "bus_voltage", "torque"),
    ):
        found = shapes_over(quantity, data)
        assert found
        assert len(set(found)) == len(found)
        for shape in found:
            assert shape.quantity == quantity
            assert set(shape.times) <= set(MULTIPLIERS)
            assert (shape.memory > 0) == (quantity == "load_history")
    assert shapes_over("phase_of_the_moon", data) == []
    assert {s.unit for s in shapes_over("water_temperature", data)} == {"degC"}
    assert {s.times for s in shapes_over("rotation_rate", data)} == {("drive",)}
    assert all(s.memory < 0.5 * data.scale.duration for s in shapes_over("load_history", data))


def since(t, V):
    """(s since the last step, volts before it)."""
    changed = np.concatenate([[0], np.flatnonzero(np.diff(V)) + 1])
    which = np.searchsorted(changed, np.arange(t.size), side="right") - 1
    return t - t[changed[which]], np.concatenate([[0.0], V[changed[1:] - 1]])[which]


def late(t, V, F):
    """Three tenths of each change come late, over half a second."""
    age, before = since(t, V)
    return F - 0.3 * (F - C * before * np.abs(before)) * np.exp(-age / 0.5)


def lossy(t, V, F):
    """A tenth is lost after the thrust has turned the other way, over a second."""
    age, before = since(t, V)
    return F * (1 - 0.1 * (before * V < 0) * np.exp(-age / 0.8))


@pytest.mark.parametrize(
    ("quantity", "times_", "change"),
    [
        ("time", "gain", lambda t, V, F: F * (1 + 0.05 * np.sin(t / 12))),
        ("time", "force", lambda t, V, F: F + 2 * np.sin(t / 12)),
        ("direction", "gain", lambda t, V, F: F * np.where(V < 0, 0.9, 1.0)),
        ("time_since_step", "step", late),
        ("time_since_step", "reversed", lossy),
        ("water_temperature", "gain", lambda t, V, F: F * (1 + 0.02 * 4 * np.sin(t / 9))),
    ],
)
def test_the_kind_and_place_that_was_planted_gains_most(quantity, times_, change):
    data, estimate = known_noise({}, [wet(change=change, rate=16.0)])
    found = best_over(quantity, estimate, data)
    assert found.gain > 100
    assert times_ in found.term.times
    bigger, theta = estimate.fit.more(found.term, found.start)
    joined = fit(bigger, theta, data, estimate.weights)
    fall = estimate.fit.chi2 - joined.chi2
    assert fall == pytest.approx(found.gain, rel=0.2, abs=120), "what is foretold is what a fit finds"
    assert foremost(estimate, data, [quantity], None) == quantity


def test_noise_gains_nothing_and_where_nothing_gains_the_first_stays():
    data, estimate = known_noise({}, [wet()])
    for quantity in ("time", "water_temperature", "previous_voltage"):
        found = best_over(quantity, estimate, data)
        assert found is None or found.gain < 0
    assert foremost(estimate, data, ["previous_voltage", "time"], None) == "previous_voltage"


def test_what_is_multiplied_at_each_row():
    data, estimate = known_noise({}, [wet()])
    h, r = data.histories[0], data.rows[0]
    theta = estimate.fit.theta
    F = theta.C * h.driver * np.abs(h.driver)
    shape = Flexible("water_temperature", "degC", (11.0, 19.0), (0,), ("force", "gain", "even", "rate"))
    over, columns = seen_at(shape, estimate.fit, data)
    assert over[0] == pytest.approx(h.others["water_temperature"][r])
    expected = np.column_stack([np.ones_like(F), F, np.abs(F), np.abs(h.driver) / data.scale.driver])[r]
    assert columns[0] == pytest.approx(expected, abs=1e-6)


def test_pulses_let_time_begin_anew():
    def pulsed(t, _V, F):
        return F * (1 - 0.08 * (((t - 3.0) % 11.3) < 1.5))

    data, estimate = known_noise({}, [short(change=pulsed, seconds=160.0)])
    known = Pulses(0, 11.3, 3.0, 1.5, -0.08, 20.0, 1000, np.empty(0))
    plain, anew = best_over("time", estimate, data), best_over("time", estimate, data, known)
    assert anew.term.period == 11.3
    assert anew.gain > (plain.gain if plain else 0) + 50
