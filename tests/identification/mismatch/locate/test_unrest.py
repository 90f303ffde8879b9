"""Noise after steps is no structure where its sign is any; what is alike after every step is."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.estimate.estimate import refresh
from identification.mismatch.locate.unrest import told_by_unrest
from identification.mismatch.model.model import Model
from identification.mismatch.pipeline import diagnose
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.select.baseline import start
from tests.identification.diagnosed_runs import C, run

SHARE, DECAY, TIME_CONSTANT = 0.03, 0.4, 0.15
"""Of the step, s, s."""


def late(t, F):
    """(n,) N, the thrust less its running mean: what has not settled."""
    keep = np.exp(-(t[1] - t[0]) / DECAY)
    mean = np.empty(F.size)
    mean[0] = F[0]
    for i in range(1, F.size):
        mean[i] = keep * mean[i - 1] + (1 - keep) * F[i]
    return F - mean


def unquiet(rng):
    def made(t, V, F):
        keep = np.exp(-(t[1] - t[0]) / TIME_CONSTANT)
        x = np.zeros(t.size)
        for i in range(1, t.size):
            x[i] = keep * x[i - 1] + np.sqrt(1 - keep**2) * rng.standard_normal()
        return F + SHARE * np.abs(late(t, F)) * x

    return made


@pytest.mark.parametrize("seed", range(3))
def test_noise_after_steps_is_nothing_that_was_left_out(seed: int) -> None:
    found = diagnose([run(unquiet(np.random.default_rng([seed, 5])), seed=seed)])
    assert isinstance(found, Diagnosis)
    assert found.verdict == "adequate", found.statement


def test_what_is_alike_after_every_step_is_found_beside_it() -> None:
    """An overshoot of a twentieth of the step."""
    noisy = unquiet(np.random.default_rng(9))
    found = diagnose([run(lambda t, V, F: noisy(t, V, F) + 0.05 * late(t, F), seed=1)])
    assert isinstance(found, Diagnosis)
    assert found.verdict != "adequate"


def deviation(estimate) -> float:
    """Of C, in its own standard errors."""
    return float((estimate.fit.theta.C - C) / estimate.fit.std[estimate.fit.layout.C])


def told(change, seed: int):
    """The baseline by a stationary law, and by noise after steps where that is plainly there; noise of 0.03 N."""
    data, theta = start([history_of(run(change, seed=seed, noise=0.03))])
    now = refresh(Model(), theta, data, None, None)
    return now, told_by_unrest(now, data), data


def test_noise_after_steps_makes_c_no_surer_than_it_is() -> None:
    """Deviations of C in 12 runs: 1 standard error in the mean square by the law that holds, nearly 2 without."""
    both = []
    for seed in range(12):
        now, quieter, _ = told(unquiet(np.random.default_rng([seed, 7])), seed)
        assert quieter is not now
        both.append((deviation(now), deviation(quieter)))
    stationary, right = np.sqrt(np.mean(np.square(both), axis=0))
    assert stationary > 1.5
    assert 0.6 < right < 1.3


def test_where_noise_is_stationary_values_are_told_by_it() -> None:
    for seed in range(5):
        now, same, _ = told(None, seed)
        assert same is now


def test_noise_after_steps_has_a_stationary_law_of_the_same_power() -> None:
    _, quieter, _ = told(unquiet(np.random.default_rng(3)), 3)
    noise, (rows,) = quieter.noise, quieter.rows
    everywhere = noise.everywhere(quieter.rows)
    assert noise.after_steps
    assert not everywhere.after_steps
    power = [v * np.mean(rows.unsettled**2) for v in noise.slow[-noise.after_steps :]]
    assert everywhere.slow[-len(power) :] == pytest.approx(power)
    assert everywhere.everywhere(quieter.rows) is everywhere
