"""What the data do not determine is said to be so, by one rule."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.diagnosis import Finding
from identification.mismatch.value import Value, of_shape, told_rows, unknown

TIME = (1.0, 400.0)


@pytest.mark.parametrize(
    ("value", "determined"),
    [
        (Value(24.0, 5844288569.0, "s", limits=TIME), False),
        (Value(24.0, 20.0, "s", limits=TIME), True),
        (Value(24.0, 399 / np.sqrt(12) + 0.1, "s", limits=TIME), False),
        (Value(200.0, 80.0, "s", (1.0, 400.0), TIME), False),
        (Value(200.0, 80.0, "s", (60.0, 380.0), TIME), True),
        (Value(1.0, 20.0, "N", limits=(-15.0, 15.0)), False),
        (Value(0.01, 0.3, "N", limits=(-15.0, 15.0)), True),
        (Value(0.01, 0.3, "V", limits=(0.0, 15.0)), False),
        (Value(3.0, 31.0, "1"), False),
        (Value(3.0, 29.0, "1"), True),
        (Value(3.0, float("inf"), "1"), False),
        (Value(3.0, float("nan"), "1", limits=(0.0, 3.0)), True),
        (Value(2.0, 0.0, "1", limits=(0.0, 3.0)), True),
    ],
)
def test_a_value_is_determined_where_its_error_says_more_than_what_it_could_be(value, determined):
    assert value.determined is determined


def test_an_interval_of_what_is_not_determined_stays_within_what_is_possible():
    assert Value(24.0, 5.8e9, "s", limits=TIME).interval == TIME
    low, high = Value(24.0, 120.0, "s", limits=TIME).interval
    assert (low, high) == (1.0, pytest.approx(24 + 1.96 * 120, rel=1e-3))
    assert Value(900.0, 200.0, "s", (800.0, 1000.0), TIME).interval == TIME
    assert Value(0.1, 1.0, "N", limits=(-9.0, 9.0)).interval[0] < -1.8


def test_an_error_as_large_as_that_of_any_number_between_the_ends():
    ends = np.random.default_rng(0).uniform(-2.0, 3.0, 200_000)
    assert unknown(1.01 * float(np.std(ends)), -2.0, 3.0)
    assert not unknown(0.99 * float(np.std(ends)), -2.0, 3.0)


def test_rows_of_a_shape_that_say_nothing_of_it():
    value, std = np.array([0.5, -1.0, 1.5, -44.7, np.nan]), np.array([0.1, 0.1, 0.4, 55.0, 0.1])
    assert told_rows(value, std).tolist() == [True, True, True, False, False]
    assert told_rows(value / 100, std).tolist() == [True, True, True, True, False], "none is sure: there is no size"
    assert told_rows(np.array([3.0, 100.0]), np.array([0.1, 30.0])).tolist() == [True, True], "sure of itself"


def test_a_splines_values_are_measured_by_the_largest_that_is_sure():
    found = of_shape({"a": Value(2.0, 0.1, "1"), "b": Value(-44.7, 55.0, "1"), "c": Value(-44.7, 5.0, "N")})
    assert [v.determined for v in found.values()] == [True, False, True]
    assert found["b"].limits == (-2.0, 2.0)


def test_a_finding_that_does_not_pay_for_itself_cannot_be_made():
    with pytest.raises(ValueError, match="heating does not pay for its parameters"):
        Finding("heating", "", "Heating.", {}, 0.1, -6.6, 1.0, ())
