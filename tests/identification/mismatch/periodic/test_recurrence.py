"""A line that comes again in another run is one; what one run has by itself was seen once."""

import numpy as np
import pytest

from identification.mismatch.periodic.order_tracking import Part
from identification.mismatch.periodic.periodic_disturbances import Line
from identification.mismatch.periodic.recurrence import rank, recurring
from identification.mismatch.periodic.spectrum import Series

FREQUENCY = 3.7
"""Hz."""


def series(amplitude: float, seed: int) -> Series:
    t = np.arange(0.0, 120.0, 0.05)
    noise = np.random.default_rng(seed).standard_normal(t.size)
    return Series(t, noise + amplitude * np.sin(2 * np.pi * FREQUENCY * t + seed))


def line(runs: int) -> Line:
    parts = tuple(Part(i, -np.inf, np.inf, 0.1, 0.0) for i in range(runs))
    return Line("fixed", FREQUENCY, 1e-3, None, None, 0.2, 0.02, 0.0, 0.1, 1e-9, 50.0, "A line.", parts=parts)


@pytest.mark.parametrize("amplitudes", [(0.2, 0.2), (0.3, 0.0, 0.2)])
def test_what_two_runs_show_is_a_line(amplitudes) -> None:
    runs = [series(a, i) for i, a in enumerate(amplitudes)]
    kept, notes = recurring([line(len(runs))], runs)
    assert (len(kept), len(notes)) == (1, 0)


def test_what_one_of_two_runs_shows_was_seen_once() -> None:
    kept, notes = recurring([line(2)], [series(0.5, 0), series(0.0, 1)])
    assert kept == ()
    (said,) = notes
    assert "0.2 N at 3.7 Hz shows in one of these runs only: seen once" in said


def test_one_run_alone_decides_nothing() -> None:
    kept, notes = recurring([line(1)], [series(0.5, 0)])
    assert (len(kept), notes) == (1, ())


def test_the_rank_of_noise_is_even_and_that_of_a_line_is_small() -> None:
    t = np.arange(0.0, 60.0, 0.05)
    every = [np.ones(t.size, dtype=bool)]
    drawn = [rank(series(0.0, seed).residual[: t.size], t, FREQUENCY, every) for seed in range(40)]
    assert 1 <= sum(p < 0.25 for p in drawn) <= 19
    assert rank(series(0.5, 1).residual[: t.size], t, FREQUENCY, every) < 0.01
