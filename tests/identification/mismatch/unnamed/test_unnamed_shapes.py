"""What has no name: kinds of flexible terms, their knots, formulas of the grammar and how they are written."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.flexible_terms.flexible import MULTIPLIERS, Flexible
from identification.flexible_terms.formula import Formula, Monomial, covariate_of, product_of, times
from identification.flexible_terms.formula import quantity as value_of
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.locate.pulses import Pulses
from identification.mismatch.locate.residual_structure_test import CovariateTest, ResidualStructure
from identification.mismatch.name.naming import Check, name
from identification.mismatch.select.covariates import Covariate
from identification.mismatch.unnamed.flexible import extend, foremost
from identification.mismatch.unnamed.flexible_kinds import shapes_over
from identification.mismatch.unnamed.flexible_knots import best_over, seen_at
from identification.mismatch.unnamed.flexible_shape import shape_of
from identification.mismatch.unnamed.formula import find_formula, halves, monomials_of, symbols_of, term_of
from identification.mismatch.unnamed.formula_words import legend, told
from identification.mismatch.unnamed.spline_knot_selection import Moments, choose, heights, nodes_of
from identification.mismatch.unnamed.stage import foremost_covariate
from identification.mismatch.validate.train_test_split import train_test_split
from identification.physics.dead_band import DeadBand
from identification.recording import Channel
from identification.run_history.splines import spline
from tests.identification.diagnosed_runs import C, dead_band, table
from tests.identification.mismatch.small import data_of, known_noise, rng, short

# ---------------------------------------------------------------- knots


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


# ---------------------------------------------------------------- kinds


def wet(seed=0, **how):
    t = np.arange(0.0, 80.0, 0.5)
    channels = (
        Channel("w", "w", "water_temperature", "degC", t, 15 + 4 * np.sin(t / 9)),
        Channel("b", "b", "bus_voltage", "V", t, 24 - 0.01 * t + 0.3 * np.cos(t / 5)),
    )
    return short(seed=seed, extra=channels, **how)


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


# ---------------------------------------------------------------- a shape with its error


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
    named = [n.asked(Check("it is one", "it is none")) for n in name(after, data, [])]
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


# ---------------------------------------------------------------- the grammar


@settings(max_examples=20, deadline=None)
@given(st.lists(st.sampled_from("abcdef"), min_size=1, max_size=5, unique=True))
def test_products_are_all_there_are_and_none_twice(symbols):
    found = monomials_of(symbols)
    assert len(set(found)) == len(found)
    n = len(symbols)
    assert len(found) == 3 * n + 3 * n * (n - 1) // 2
    assert all(1 <= sum(p for _, p in powers) <= 3 and len(powers) <= 2 for powers in found)


def low_passed(value, dt, tau):
    """(M,) means over intervals of y' = (value - y)/tau from 0, value constant in each."""
    y, out = 0.0, []
    for v, step in zip(value, dt, strict=True):
        keep = np.exp(-step / tau)
        out.append(v + (y - v) * (1 - keep) * tau / step)
        y = v + (y - v) * keep
    return np.array(out)


def test_a_low_pass_of_the_size_is_not_that_of_the_square():
    data, _ = data_of([wet()])
    h = data.histories[0]
    assert value_of("lp20(|V|)", h) == pytest.approx(low_passed(np.abs(h.driver), h.dt, 20.0), abs=1e-6)


def test_a_coefficient_of_a_low_pass_of_the_square_is_told_per_square():
    data, before = known_noise({}, [wet()])
    term = term_of((Monomial((("lp20(V|V|)", 1),), "1"),), {"lp20(V|V|)": 40.0}, data)
    now = fit(*before.fit.more(term, (0.0,)), data, before.weights)
    assert told(term, now, data)[1]["a"].unit == "N/V^2"


def test_symbols_are_what_moves():
    data, _ = data_of([wet()])
    known = symbols_of(data)
    assert {"V", "t", "T_w", "V_b"} <= known.keys()
    assert "U" not in known
    h = data.histories[0]
    assert known["V"][0] == pytest.approx(h.driver)
    assert known["t"][0] == pytest.approx(h.middle)
    assert known["lp20(V|V|)"][0] == pytest.approx(low_passed(h.driver * np.abs(h.driver), h.dt, 20.0), abs=1e-6)
    flat, _ = data_of([table(lambda v: C * v * np.abs(v))])
    assert list(symbols_of(flat)) == ["V"]


def test_a_monomial_is_its_product():
    unit = {"a": np.array([2.0, 3.0]), "b": np.array([5.0, 7.0])}
    assert product_of(Monomial((("a", 2), ("b", 1)), "F"), unit).tolist() == [20.0, 63.0]
    F = np.array([-4.0, 5.0])
    assert [times(k, F).tolist() for k in ("1", "F", "|F|")] == [[1.0, 1.0], [-4.0, 5.0], [4.0, 5.0]]
    assert Formula((Monomial((("T_w", 2),), "F"), Monomial((("t", 1),), "1")), ()).form == "T_w^2 F + t"
    assert (covariate_of("T_w"), covariate_of("t"), covariate_of("lp20(|V|)")) == (
        "water_temperature",
        "time",
        "load_history",
    )
    data, _ = data_of([short()])
    assert np.isnan(value_of("T_w", data.histories[0])).all()


@pytest.fixture(scope="module")
def warming():
    """Gain falls with the square of the distance of the water from 13 degC."""

    def colder(t, _V, F):
        return F * (1 - 0.004 * (15 + 4 * np.sin(t / 9) - 13.0) ** 2)

    data, before = known_noise({}, [wet(change=colder)])
    monomials = (Monomial((("T_w", 1),), "F"), Monomial((("T_w", 2),), "F"))
    term = term_of(monomials, {"T_w": 19.0}, data)
    bigger, theta = before.fit.more(term, (0.0, 0.0))
    return data, before, term, replace(before, fit=fit(bigger, theta, data, before.weights))


def test_coefficients_are_told_in_units_with_their_errors(warming):
    """Beside a regression on the products in their own units."""
    data, _, term, estimate = warming
    text, values = told(term, estimate.fit, data)
    a, middle = values["a"], values["T_w_0"]
    assert a.unit == "N/(V^2 degC^2)"
    assert abs(a.value + 0.004 * C) < 4 * a.std < 0.5 * 0.004 * C
    assert abs(middle.value - 13.0) < 4 * middle.std < 1.5
    assert text.startswith("residual = (")
    assert text.endswith(") degC)^2 V|V|")
    assert legend(term) == "T_w: water_temperature"
    h, r = data.histories[0], data.rows[0]
    T, V = h.others["water_temperature"][r], h.driver[r]
    X = np.column_stack([V * np.abs(V) * T**2, V * np.abs(V) * T, V * np.abs(V), np.ones(r.size)])
    beta = np.linalg.lstsq(X, h.thrust[r], rcond=None)[0]
    assert a.value == pytest.approx(beta[0], rel=0.05)
    assert middle.value == pytest.approx(-beta[1] / beta[0] / 2, abs=0.2)


def test_one_product_is_told_plainly_and_a_low_pass_by_its_time():
    data, before = known_noise({}, [wet(change=lambda t, V, F: F + 0.02 * t)])
    term = term_of((Monomial((("t", 1),), "1"),), {"t": 80.0}, data)
    bigger, theta = before.fit.more(term, (0.0,))
    now = fit(bigger, theta, data, before.weights)
    text, values = told(term, now, data)
    assert values["a"].unit == "N/s"
    assert values["a"].value == pytest.approx(0.02, abs=4 * values["a"].std)
    assert text.endswith(" t")
    slow = Formula((Monomial((("lp20(V|V|)", 1), ("V", 2)), "|F|"),), (("lp20(V|V|)", 1.0), ("V", 1.0)))
    assert legend(slow) == "lp20(V|V|): low-pass of V|V|, 20 s, V: command or motor voltage"


def test_the_same_coefficients_in_both_halves(warming):
    data, before, term, estimate = warming
    assert halves(term, estimate, data) > 1e-3

    def changing(t, _V, F):
        size = np.where(t < 40, 0.002, 0.006)
        return F * (1 - size * (15 + 4 * np.sin(t / 9) - 13.0) ** 2)

    data, before = known_noise({}, [wet(change=changing)])
    bigger, theta = before.fit.more(term, (0.0, 0.0))
    other = replace(before, fit=fit(bigger, theta, data, before.weights))
    assert halves(term, other, data) < 1e-6


def test_a_formula_takes_the_place_of_the_free_shape_where_it_predicts_as_well(warming):
    data, before, _, _ = warming
    split = train_test_split(before, data, ())
    free = extend(before, before, data, "water_temperature", (), split, rng(0))
    found = find_formula(free, data, ())
    assert found is not None
    assert "T_w" in found.text
    assert found.heldout_after < found.heldout_before
    assert found.bic_gain > 20
    assert found.halves_p > 1e-3


def test_a_step_of_the_gain_is_no_formula():
    data, before = known_noise({}, [wet(change=lambda t, _V, F: F * np.where(t < 37, 1.0, 0.9))])
    free = extend(before, before, data, "time", (), train_test_split(before, data, ()), rng(0))
    assert find_formula(free, data, ()) is None


def test_a_recorded_quantity_goes_before_time_that_does_as_well():
    """Water that warms evenly is time by another name: what the thermometer says is told."""
    t = np.arange(0.0, 80.0, 0.5)
    water = Channel("w", "w", "water_temperature", "degC", t, 12 + 0.05 * t)
    run = short(change=lambda t, _V, F: F * (1 - 0.003 * t), extra=(water,))
    data, before = known_noise({}, [run])
    free = extend(before, before, data, "time", (), train_test_split(before, data, ()), rng(0))
    found = find_formula(free, data, ())
    assert "T_w" in found.text
    assert "T_w" in found.symbols
    assert any("t" in other.split() for other in found.equals)
