"""What wanders once over the run looks like slow noise: it is told from noise by estimating both."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.pipeline import diagnose
from sim_devices import concealed
from tests.concealed.recordings import recording
from tests.identification.diagnosed_runs import run


@pytest.mark.parametrize(
    ("effect", "seed"),
    [
        ("zero_drift", [585108840, 119500914, 846751032, 2690190745]),
        ("gain_wave", [460914168, 2782258338, 4238528478, 4157318331]),
    ],
)
def test_a_slow_change_that_no_term_carries_is_located_in_time(effect: str, seed: list[int]) -> None:
    """Forty sigma to an oracle, and nothing beside the noise that was estimated on it."""
    case = concealed.case(np.random.default_rng(seed), [effect], 40.0)
    found = diagnose([recording(case)], without=[effect])
    assert isinstance(found, Diagnosis)
    assert found.verdict == "unexplained"
    assert found.unexplained is not None
    assert found.unexplained.where.quantity == "time"
    assert not found.findings


@pytest.mark.parametrize("seed", range(3))
def test_slow_noise_is_no_change(seed: int) -> None:
    """A random walk towards zero with a time constant of a third of the run."""
    rng = np.random.default_rng([seed, 7])

    def wandering(t, V, F):
        step = np.exp(-(t[1] - t[0]) / 50.0)
        x = np.zeros(t.size)
        for i in range(1, t.size):
            x[i] = step * x[i - 1] + 0.5 * np.sqrt(1 - step**2) * rng.standard_normal()
        return F + x

    found = diagnose([run(wandering, seed=seed)])
    assert isinstance(found, Diagnosis)
    assert found.verdict == "adequate"
