"""C and its error by noise after steps, where that is plainly there."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.estimate.estimate import refresh
from identification.mismatch.locate.unrest import told_by_unrest
from identification.mismatch.model.model import Model
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.select.baseline import start
from tests.identification.diagnosed_runs import C, run
from tests.identification.mismatch.locate.unquiet import unquiet


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
