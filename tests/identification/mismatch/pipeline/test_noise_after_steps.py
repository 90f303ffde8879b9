"""Noise after steps is no structure where its sign is any; what is alike after every step is."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.pipeline import diagnose
from tests.identification.diagnosed_runs import run

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
