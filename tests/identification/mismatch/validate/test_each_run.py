"""Values by single runs: said where runs want other values, silent where one value is behind all of them."""

from collections.abc import Sequence

import numpy as np
import pytest

from identification.mismatch.validate.each_run import RunDifference, determined, run_differences, same_value
from identification.physics.dead_band import DeadBand
from tests.identification.diagnosed_runs import dead_band
from tests.identification.mismatch.small import known_noise, short

BAND = DeadBand()


def said(widths: Sequence[float]) -> str:
    """Of runs with these dead bands, modelled by one; empty where they differ by no more than their errors."""
    made = [short(seed=i, volts=dead_band(width)) for i, width in enumerate(widths)]
    data, estimate = known_noise({BAND: (float(np.mean(widths)),)}, made)
    found = run_differences(estimate, data, [BAND])
    return found[BAND].statement if BAND in found else ""


def test_runs_with_one_dead_band_say_nothing_of_a_difference() -> None:
    assert said((1.0, 1.0, 1.0)) == ""
    assert said((1.0,)) == ""


def test_a_dead_band_that_is_another_in_each_run_is_said_to_be() -> None:
    told = said((0.4, 1.2))
    assert told.startswith("From run to run its half width differs by more than its errors: 0.4")
    assert told.endswith(" to 1.2 V.")


def test_a_small_difference_is_one_value_to_a_person_however_clear() -> None:
    assert said((1.0, 1.1)) == ""


@pytest.mark.parametrize("seed", range(3))
def test_errors_that_are_right_make_p_values_that_are_even(seed: int) -> None:
    rng = np.random.default_rng(seed)
    p = [same_value([(float(v), 0.1) for v in 1 + 0.1 * rng.standard_normal(4)]) for _ in range(400)]
    assert np.mean(p) == pytest.approx(0.5, abs=0.06)
    assert np.mean(np.array(p) < 0.05) < 0.1


def test_what_a_run_does_not_determine_is_not_compared() -> None:
    assert not determined(0.4, 24.0)
    assert not determined(0.4, float("inf"))
    assert same_value([(1.0, 0.1), (30.0, 24.0)]) == 1.0


def test_the_sentence_has_the_name_the_range_and_the_unit() -> None:
    said = RunDifference("time_constant", "s", 0.043, 0.99, 1e-9).statement
    assert said == "From run to run its time constant differs by more than its errors: 0.043 to 0.99 s."
    assert RunDifference("share", "1", 0.1, 0.5, 1e-9).statement.endswith("0.1 to 0.5.")
