"""What is told of findings that are new, that may be, and that are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.flexible_terms.flexible import Flexible
from identification.mismatch.answer.against_twin import changed_constant, told_new, twin_of, with_twin
from identification.mismatch.compare.earlier_recordings import Novelty
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.value import Value
from identification.physics.exponent import Exponent
from tests.identification.diagnosed_runs import C
from tests.identification.mismatch.answer.answered import BAND, LEFT, UNEVEN, draft, finding
from tests.identification.mismatch.small import known_noise, short

SHAPE = Flexible("command_voltage", "V", (-5.0, 0.0, 5.0), (1,), ("force",))


def test_what_is_not_new_is_no_finding_and_what_may_be_says_so():
    found = {BAND: finding(), UNEVEN: finding("asymmetry")}
    both = told_new(found, {BAND: Novelty("there before", -34.0), UNEVEN: Novelty("not shown before", 2.0)}, None)
    assert [f.effect for f in both.findings] == ["asymmetry"]
    assert both.findings[0].since == "not shown before"
    assert "could not have shown it" in both.findings[0].statement
    assert both.not_new == (found[BAND].statement,)
    assert "chi-square of both -34" in both.notes[0]


def test_what_is_new_says_so_and_what_nobody_asked_stays_as_it_is():
    found = {BAND: finding(), UNEVEN: finding("asymmetry")}
    told = told_new(found, {BAND: Novelty("changed", 80.0)}, None)
    assert [f.since for f in told.findings] == ["changed", ""]
    says = " That is new: the recordings behind the twin speak against it."
    assert [f.statement for f in told.findings] == [found[BAND].statement + says, found[UNEVEN].statement]
    assert (told.not_new, told.notes) == ((), ())


def test_of_what_the_twin_has_the_amount_is_new(fitted):
    runs, data, estimate = fitted
    twin = twin_of(estimate, data, runs, None)
    (told,) = told_new({BAND: finding()}, {BAND: Novelty("changed", 80.0)}, twin).findings
    assert told.statement.endswith(f" That amount is new: the recordings behind {twin.origin} speak against it.")


def test_what_has_no_name_and_was_there_before_is_not_left():
    told = told_new({}, {SHAPE: Novelty("there before", -20.0)}, None, LEFT, [SHAPE])
    assert told.left is None
    assert told.not_new == (LEFT.statement,)
    assert "chi-square of both -20" in told.notes[0]


@pytest.mark.parametrize(
    ("novelty", "says"),
    [(Novelty("changed", 40.0), "speak against it."), (Novelty("not shown before", 1.0), "could not have shown it.")],
)
def test_what_has_no_name_says_whether_it_is_new(novelty, says):
    both = {SHAPE: novelty, BAND: Novelty("there before", -20.0)}
    told = told_new({}, both, None, LEFT, [SHAPE, BAND])
    assert (told.left.where, told.left.p_value) == (LEFT.where, LEFT.p_value)
    assert told.left.statement.startswith(LEFT.statement)
    assert told.left.statement.endswith(says)
    assert (told.not_new, told.notes) == ((), ())


@pytest.mark.parametrize("novelties", [{SHAPE: Novelty("changed", 40.0)}, {}])
def test_what_has_no_name_is_not_called_new_where_the_twin_had_left_something_too(novelties):
    """The same left-out physics drew one shape over the run's time and another over the loads of the next."""
    told = told_new({}, novelties, None, LEFT, [SHAPE], left_then=True)
    assert told.left.statement.endswith("the recordings behind the twin left something without a name as well.")
    before = told_new({}, {SHAPE: Novelty("there before", -9.0)}, None, LEFT, [SHAPE], left_then=True)
    assert before.left is None


def test_of_terms_without_a_name_all_must_have_been_asked():
    """One over the run's own time is not, nor is anything where no term models what is left."""
    assert told_new({}, {SHAPE: Novelty("there before", -20.0)}, None, LEFT, [SHAPE, UNEVEN]).left is LEFT
    assert told_new({}, {}, None, LEFT, []).left is LEFT


def test_a_little_of_the_constant_beside_what_is_left_is_a_note(fitted):
    """A free shape that multiplies the thrust has a part of C."""
    runs, data, estimate = fitted
    now = twin_of(estimate, data, runs, None)
    before = replace(now, C=0.99 * now.C, covariance=tuple(tuple(1e-6 * v for v in row) for row in now.covariance))
    before = replace(before, covariance=((1e-12, *before.covariance[0][1:]), *before.covariance[1:]))
    sure = replace(estimate, fit=replace(estimate.fit, jacobian=100 * estimate.fit.jacobian))
    assert changed_constant(before, sure, data, "", Value(now.C, 0.0, "N/V^2")) is not None
    alone = with_twin(draft(model={"C": Value(now.C, 0.0, "N/V^2")}), sure, data, runs, before)
    assert [f.effect for f in alone.findings] == ["thrust_constant"]
    beside = with_twin(draft(model={"C": Value(now.C, 0.0, "N/V^2")}), sure, data, runs, before, beside=True)
    assert beside.findings == ()
    assert "is left, may be in it" in beside.notes[0]


def test_c_beside_a_term_that_refers_it_to_a_voltage_is_no_change():
    """Of thrust that grows as |V|^2.05 C is that of the highest level, and the twin's that of the middle: 2.4 % and 11
    sigma were told as a changed thrust constant beside the exponent."""
    runs = [short(lambda _, V, F: F * np.abs(V / 4.0) ** 0.05, seconds=60.0)]
    data, estimate = known_noise({Exponent(): (2.05,)}, runs)
    bare = twin_of(replace(estimate, fit=fit(*estimate.fit.less(Exponent()), data, estimate.weights)), data, runs, None)
    sure = replace(bare, covariance=((1e-12,),))
    told = with_twin(draft(findings=(finding("exponent"),)), estimate, data, runs, replace(sure, C=C))
    assert [f.effect for f in told.findings] == ["exponent"]
    assert "may be in it" in told.notes[0]
    far = with_twin(draft(findings=(finding("exponent"),)), estimate, data, runs, replace(sure, C=0.7 * C))
    assert [f.effect for f in far.findings] == ["exponent", "thrust_constant"]
