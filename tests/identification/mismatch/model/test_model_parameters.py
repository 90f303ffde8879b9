"""Values of a model by name: what is written at a name is read there, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.mismatch.model.model import Model, extended, reduced, with_values
from identification.mismatch.model.parameters import Layout, Theta
from identification.physics.asymmetry import Asymmetry
from identification.physics.catalogue import CATALOGUE
from identification.physics.dead_band import DeadBand
from identification.physics.term import STAGES, Scale
from identification.physics.zero_offset import ZeroOffset

SCALE = Scale(12.0, "V", 72.0, 100.0, 0.01, 1.0, 73.0, 0.3, 0.5)
numbers = st.floats(-1e6, 1e6)


def counts(terms):
    return tuple(len(t.parameters(SCALE)) for t in terms)


@st.composite
def thetas(draw):
    terms = tuple(draw(st.lists(st.sampled_from(CATALOGUE), max_size=5, unique=True)))
    values = tuple(tuple(draw(numbers) for _ in range(n)) for n in counts(terms))
    runs = draw(st.integers(1, 4))
    theta = Theta(
        draw(numbers), values, tuple(draw(numbers) for _ in range(runs)), draw(numbers), draw(numbers), draw(numbers)
    )
    return terms, theta


@settings(max_examples=30, deadline=None)
@given(thetas())
def test_a_vector_holds_all_values_and_gives_them_back(case):
    terms, theta = case
    again = theta.with_vector(theta.vector)
    assert (again.C, again.terms, again.tares) == (theta.C, theta.terms, theta.tares)
    assert (again.shift, again.rate_shift, again.k) == (theta.shift, theta.rate_shift, theta.k)
    assert theta.vector.size == Layout(terms, counts(terms), len(theta.tares)).size


@settings(max_examples=30, deadline=None)
@given(thetas())
def test_every_place_of_the_vector_has_one_name(case):
    """What is written by its name is read back as that value; together the names are all places, once each."""
    terms, theta = case
    at = Model(terms).layout(theta)
    vector = theta.vector
    assert vector[at.C] == theta.C
    assert (vector[at.shift], vector[at.rate_shift], vector[at.k]) == (theta.shift, theta.rate_shift, theta.k)
    assert tuple(vector[at.tares]) == theta.tares
    named = [at.C, at.shift, at.rate_shift, at.k, *(at.tare(i) for i in range(len(theta.tares)))]
    for term, values in zip(terms, theta.terms, strict=True):
        assert tuple(vector[at.of(term)]) == values
        for p, value in zip(term.parameters(SCALE), values, strict=True):
            named.append(at.parameter(term, p.name, SCALE))
            assert vector[named[-1]] == value
    assert sorted(named) == list(range(at.size))
    of_terms = list(range(at.size))[at.of_terms]
    assert len(of_terms) == sum(map(len, theta.terms))
    assert [at.run_of(i) for i in range(at.size) if at.run_of(i) is not None] == list(range(len(theta.tares)))


def test_an_unknown_name_is_an_error():
    at = Layout((DeadBand(),), (1,), 1)
    with pytest.raises(KeyError):
        at.of(Asymmetry())
    with pytest.raises(ValueError, match="is not in list"):
        at.parameter(DeadBand(), "no_such", SCALE)


@settings(max_examples=30, deadline=None)
@given(st.permutations(CATALOGUE), st.integers(1, 8))
def test_terms_stand_in_the_order_in_which_they_act_however_they_were_added(order, many):
    model = Model()
    for term in order[:many]:
        model = model.plus(term)
    stages = [STAGES.index(t.stage) for t in model.terms]
    assert stages == sorted(stages)
    other = Model()
    for term in reversed(order[:many]):
        other = other.plus(term)
    assert other == model
    assert model.swapped(order[0], order[0]) == model
    assert order[0] not in model.without(order[0]).terms


def test_values_stay_with_their_terms_while_a_model_grows_and_shrinks():
    band, offset, uneven = DeadBand(), ZeroOffset(), Asymmetry()
    model, theta = Model((offset,)), Theta(0.5, ((2.0, 30.0),), (1.0,))
    model, theta = extended(model, theta, band, (1.5,))
    model, theta = extended(model, theta, uneven, (0.8,))
    assert model.values(theta) == {band: (1.5,), uneven: (0.8,), offset: (2.0, 30.0)}
    theta = with_values(model, theta, offset, (3.0, 40.0))
    less, rest = reduced(model, theta, (band,))
    assert less.values(rest) == {uneven: (0.8,), offset: (3.0, 40.0)}
    assert (rest.C, rest.tares) == (0.5, (1.0,))
    assert np.array_equal(rest.vector, [0.5, 0.8, 3.0, 40.0, 1.0, 0.0, 0.0, 1.0])
