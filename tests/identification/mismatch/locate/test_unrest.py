"""Noise after steps is told from noise that is the same throughout, with its size, and not where there is none."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.locate.unrest import DECAYS, TIME_CONSTANTS, beside_unrest
from tests.identification.diagnosed_runs import NOISE, C, run, table
from tests.identification.mismatch.locate.unquiet import DECAY, SHARE, late, unquiet
from tests.identification.mismatch.small import known_noise, rng


def measured(change=None, seed=0):
    return known_noise({}, [run(change, seed=seed, seconds=60.0, rate=20.0)])


@pytest.fixture(scope="module")
def restless():
    data, estimate = measured(unquiet(rng(5)))
    found = beside_unrest(estimate, data)
    assert found is not None
    return data, estimate, found


@pytest.mark.parametrize("seed", range(3))
def test_noise_that_is_the_same_throughout_is_none(seed):
    data, estimate = measured(seed=seed)
    assert beside_unrest(estimate, data) is None


def test_its_size_goes_with_what_has_not_settled(restless):
    """A share of it as it was put in, within a factor of two, whatever decay it takes to say so."""
    _, _, found = restless
    noise = found.noise
    assert noise.after_steps == len(TIME_CONSTANTS)
    share = np.sqrt(sum(noise.slow[-noise.after_steps :]))
    assert 0.5 * SHARE < share < 2.0 * SHARE
    decay = noise.scales[-1] / TIME_CONSTANTS[-1]
    assert decay == pytest.approx(min(DECAYS, key=lambda d: abs(np.log(d / decay))))
    assert 0.25 * DECAY < decay < 4 * DECAY


def test_rows_say_how_far_the_thrust_is_from_its_mean_of_late(restless):
    """Of the thrust that the model predicts: 0 in a rest that lasts, and the whole step just after one."""
    data, _, found = restless
    (rows,) = found.rows
    h = data.histories[0]
    V, since = h.driver[h.rows], np.inf * np.ones(h.rows.size)
    last = -np.inf
    for i, at in enumerate(h.edges[h.rows]):
        if i and V[i] != V[i - 1]:
            last = at
        since[i] = at - last
    assert rows.unsettled is not None
    assert np.all(rows.unsettled[since < 0.02] > 0.5 * np.abs(np.diff(C * V * np.abs(V), prepend=0.0))[since < 0.02])
    assert np.median(rows.unsettled[since > 2.5]) < 0.2


def test_residuals_after_steps_are_as_large_as_others_once_they_are_weighed(restless):
    """Of the model with that noise; with the noise that is the same throughout they are far larger."""
    data, before, found = restless
    (rows,) = found.rows
    soon = rows.unsettled > np.quantile(rows.unsettled, 0.9)
    was, now = (np.mean(e.fit.residual[: data.size][soon] ** 2) for e in (before, found))
    assert was > 3.0
    assert now == pytest.approx(1.0, abs=0.35)


def test_the_white_noise_beside_it_is_what_was_put_in(restless):
    assert np.sqrt(restless[2].noise.white) == pytest.approx(NOISE, rel=0.1)


def test_what_is_alike_after_every_step_is_not_taken_for_noise():
    """An overshoot without any scatter is a shape over the time since the step: beside that nothing is unquiet."""
    data, estimate = measured(lambda t, V, F: F + 0.05 * late(t, F))
    assert beside_unrest(estimate, data) is None


def test_a_table_has_no_time_after_a_step():
    data, estimate = known_noise({}, [table(lambda v: C * v * np.abs(v))], std=0.05)
    assert beside_unrest(estimate, data) is None
