"""Noise after steps is no structure where its sign is any; what is alike after every step is."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.pipeline import diagnose
from tests.identification.diagnosed_runs import run
from tests.identification.mismatch.locate.unquiet import late, unquiet


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
