"""Formulas of the grammar: products, units, and when one takes the place of a free shape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.flexible_terms.formula import Formula, Monomial, covariate_of, product_of, times
from identification.flexible_terms.formula import quantity as value_of
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.unnamed.flexible import extend
from identification.mismatch.unnamed.formula import find_formula, halves, monomials_of, symbols_of, term_of
from identification.mismatch.unnamed.formula_words import legend, told
from identification.mismatch.validate.train_test_split import train_test_split
from identification.recording import Channel
from tests.identification.diagnosed_runs import C, table
from tests.identification.mismatch.small import data_of, known_noise, rng, short
from tests.identification.mismatch.unnamed.shaped_runs import wet


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
