"""A trace holds all that each stage was given and gave: any of them, run again on what stands there, says the same."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.answer.explained.trace import Trace
from identification.mismatch.locate import stage as locate
from identification.mismatch.name import stage as name
from identification.mismatch.pipeline import Draws, traced
from identification.mismatch.unnamed import stage as unnamed
from identification.mismatch.validate import stage as validate
from tests.identification.diagnosed_runs import dead_band, run

SEED = 3
RUN = run(volts=dead_band(1.5), seconds=45.0, rate=8.0)


@pytest.fixture(scope="module")
def trace() -> Trace:
    found = traced([RUN], seed=SEED)
    assert isinstance(found, Trace)
    return found


def test_each_stage_begins_with_what_the_one_before_it_handed_on(trace: Trace) -> None:
    assert trace.prepared.recordings == (RUN,)
    assert trace.sound.histories == trace.prepared.histories, "nothing was repaired"
    assert trace.first.data.histories == trace.sound.histories
    assert trace.cleaned.histories == trace.selected.data.histories
    assert trace.located.estimate.fit.model == trace.selected.after.fit.model
    assert {n.term for n in trace.named} == set(trace.located.estimate.fit.model.terms)
    assert {n.term for n in trace.completed.earned} <= {n.term for n in trace.named}


def test_what_was_located_is_located_again(trace: Trace) -> None:
    again = locate.run(trace.selected, Draws.of(SEED).locate)
    assert again.left.p_value == trace.located.left.p_value
    assert [g.covariate.quantity for g in again.left.groups] == [
        g.covariate.quantity for g in trace.located.left.groups
    ]


def test_names_and_scores_are_made_again(trace: Trace) -> None:
    named = name.run(trace.selected, trace.located)
    assert [(n.term, n.theta, n.p_value, n.failed_checks) for n in named] == [
        (n.term, n.theta, n.p_value, n.failed_checks) for n in trace.named
    ]
    scores = validate.run(trace.located.estimate, trace.named, trace.selected.data, ()).scores
    assert scores.whole.rmse == pytest.approx(trace.validated.scores.whole.rmse)


def test_the_model_is_completed_again(trace: Trace) -> None:
    again = unnamed.run(trace.selected, trace.located, trace.validated, (), Draws.of(SEED).unnamed)
    assert again.after.fit.model == trace.completed.after.fit.model
    assert np.array_equal(again.after.fit.theta.vector, trace.completed.after.fit.theta.vector)
