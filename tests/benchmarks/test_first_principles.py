"""Thrusters that share nothing with the concealed world are told as they are: a few of the benchmark's cases."""

import pytest

from benchmarks.diagnosis.first_principles import AGAIN, CASES, FIVE, as_concealed, recording
from identification.mismatch.pipeline import diagnose


@pytest.mark.parametrize(
    ("case", "plan"),
    [("nothing", "steps"), ("stand of 18 Hz", "steps"), ("cell on its stop", "stairs"), ("inflow", "stairs")],
)
def test_a_thruster_that_nobody_here_drew_is_told_as_it_is(case, plan):
    world, wanted = CASES[case]
    assert as_concealed(diagnose([recording(world, plan, 3)]), wanted)


@pytest.mark.timeout(180)
def test_a_second_run_of_five_effects_has_changed_as_it_has_and_no_more():
    """A dead band that jumps somewhere between two levels of the first run was told as changed beside anything new."""
    twin = diagnose([recording(FIVE, "steps", 1000)]).twin
    for case, seed in (("nothing", 0), ("even bend", 40)):
        world, wanted = AGAIN[case]
        assert as_concealed(diagnose([recording(world, "steps", seed)], baseline=twin), wanted)
