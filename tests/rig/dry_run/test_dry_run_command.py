"""The command that is drawn is the plan's: as long, as high, never steeper; and its levels are its holds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.campaign.dwell import FixedDwell
from rig.campaign.plan import Plan
from rig.campaign.shapes import Interleaved, Levels, Ramp, Sine, Staircase
from rig.dry_run.command import Level, corners, levels

SHAPES = st.one_of(
    st.builds(Staircase, max=st.floats(1.0, 20.0), levels=st.integers(1, 6)),
    st.builds(Interleaved, max=st.floats(1.0, 20.0), levels=st.integers(1, 6)),
    st.builds(Levels, voltages=st.lists(st.floats(-20.0, 20.0), min_size=1, max_size=8).map(tuple)),
    st.builds(Ramp, max=st.floats(1.0, 20.0), rate=st.floats(0.1, 5.0)),
    st.builds(Sine, amplitude=st.floats(0.5, 2.0), frequencies=st.just((0.05, 0.2)), cycles=st.integers(1, 3)),
)


@given(
    shape=SHAPES,
    slew=st.floats(5.0, 30.0),
    repeats=st.integers(1, 3),
    zero_every=st.integers(0, 3),
    reversal=st.sampled_from([0.0, 2.0]),
)
def test_it_is_as_long_and_as_high_as_the_plan_and_not_steeper(shape, slew, repeats, zero_every, reversal):
    plan = Plan(shape, FixedDwell(2.0), slew, repeats, zero_every, settle_reversal=reversal)
    time, volts = corners(plan)
    assert time[0] == 0.0
    assert time[-1] == pytest.approx(plan.duration().expected)
    assert np.all(np.diff(time) >= 0.0)
    assert np.abs(volts).max() == pytest.approx(plan.peak(), rel=0.01)
    assert np.all(np.abs(np.diff(volts)) <= slew * np.diff(time) * 1.0001 + 1e-9)
    assert (volts[0], volts[-1]) == (0.0, 0.0)


def test_holds_of_one_level_are_counted_together():
    plan = Plan(Staircase(max=8.0, levels=2, sides="forward"), FixedDwell(3.0), 10.0, repeats=2)
    assert levels(plan) == (Level(4.0, 4, 12.0), Level(8.0, 2, 6.0))


def test_a_sine_has_no_levels_and_the_area_of_its_cycles():
    plan = Plan(Sine(amplitude=2.0, frequencies=(0.1,), cycles=4, offset=3.0), FixedDwell(1.0), 10.0)
    (sine,) = [step for step in plan if step.phase == "sine"]
    assert levels(plan) == ()
    time, volts = corners([sine])
    assert np.trapezoid(volts, time) == pytest.approx(3.0 * 40.0)
    assert np.trapezoid((volts - 3.0) ** 2, time) == pytest.approx(2.0 * 40.0, rel=0.02)
