"""Expressions of import maps: arithmetic over columns, and nothing that could do harm."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import ConfigError
from rig.importing.expression import evaluate, names_in

NUMBERS = st.floats(-1e6, 1e6)


@given(NUMBERS, NUMBERS)
def test_it_computes_as_python_does(a, b):
    text = "-a * 2 + abs(b - 3) / 4 - (+b) * sign(a)"
    expected = -a * 2 + abs(b - 3) / 4 - b * np.sign(a)
    assert evaluate(text, {"a": np.array([a]), "b": b}).tolist() == pytest.approx([expected])


def test_names_are_found_once_and_in_order():
    assert names_in("b + a * b - abs(c1)") == ("b", "a", "c1")


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('true')",
        "a.b",
        "a[0]",
        "a ** 9999999",
        "a if b else c",
        "lambda: 1",
        "[a]",
        "'text'",
        "True",
        "exp(a)",
        "abs(a, b)",
        "abs(x=a)",
        "a < b",
        "~a",
        "(a := 1)",
    ],
)
def test_anything_else_is_refused(text):
    with pytest.raises(ConfigError, match="only numbers, names"):
        names_in(text)


def test_what_is_no_expression_is_refused():
    with pytest.raises(ConfigError, match=r"write for example `\(pwm - 1500\) / 400`"):
        names_in("a +")


@pytest.mark.parametrize(
    "text",
    [
        "-" * 10**6 + "1",
        "(" * 1000 + "1" + ")" * 1000,
        "9" * 5000,
        "9" * 400 + " + a",
        "1e999 * a",
        "9" * 31 + "*a",
        "a\0",
    ],
    ids=range(7),
)
def test_depth_and_digits_are_bounded(text):
    with pytest.raises(ConfigError, match="expression"):
        names_in(text)


def test_whole_numbers_do_not_grow():
    assert evaluate(" * ".join(["9" * 29] * 12), {}).tolist() != evaluate("1", {}).tolist()
