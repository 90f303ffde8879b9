"""Plans: their steps, their times, and what is refused."""

from math import inf, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.campaign.dwell import FixedDwell, SteadyDwell
from rig.campaign.plan import Plan, TareConfig
from rig.campaign.shapes import Interleaved, Levels, Ramp, RandomOrder, Sine, Staircase
from rig.errors import PlanError

DWELL = FixedDwell(2.0)


def holds(plan: Plan) -> list[float]:
    return [step.voltage for step in plan if step.phase == "hold"]


def test_staircase_goes_up_and_down_on_both_sides():
    assert holds(Plan(Staircase(6.0, 3), DWELL, 10.0)) == [2, 4, 6, 4, 2, -2, -4, -6, -4, -2]
    assert holds(Plan(Staircase(6.0, 2, min=4.0, sides="reverse"), DWELL, 10.0)) == [-4, -6, -4]
    assert holds(Plan(Staircase(6.0, 1, sides="forward"), DWELL, 10.0, repeats=2)) == [6, 6]


def test_interleaved_alternates():
    assert holds(Plan(Interleaved(6.0, 3), DWELL, 10.0)) == [2, -2, 4, -4, 6, -6]


def test_random_order_is_a_permutation_that_the_seed_decides():
    plan = Plan(RandomOrder(6.0, 3, seed=7), DWELL, 10.0, repeats=2)
    first, second = holds(plan)[:6], holds(plan)[6:]
    assert sorted(first) == sorted(second) == [-6, -4, -2, 2, 4, 6]
    assert first != second
    assert holds(plan) == holds(plan)


def test_steps_in_full():
    plan = Plan(Levels((5.0, -5.0, 5.0)), DWELL, 10.0, zero_every=2, rest=1.0)
    assert [(s.index, s.phase, s.voltage) for s in plan] == [
        (0, "tare", 0), (1, "ramp", 5), (2, "hold", 5), (3, "ramp", -5), (4, "hold", -5), (5, "ramp", 0),
        (6, "rest", 0), (7, "tare", 0), (8, "ramp", 5), (9, "hold", 5), (10, "ramp", 0), (11, "rest", 0),
        (12, "tare", 0),
    ]  # fmt: skip


def test_levels_may_have_their_own_durations():
    plan = Plan(Levels((5.0, -5.0), (3.0, 4.0)), FixedDwell(2.0, settle=1.0), 10.0, repeats=2)
    found = [(s.voltage, s.min_duration, s.max_duration, s.settle) for s in plan if s.phase == "hold"]
    assert found == [(5.0, 3.0, 3.0, 1.0), (-5.0, 4.0, 4.0, 1.0)] * 2


def test_duration_and_peak():
    plan = Plan(Levels((5.0,)), SteadyDwell(1.0, 3.0, 0.1, 0.1), 10.0, rest=1.0, tare=TareConfig(2.0, attempts=2))
    # tare 2, ramp 0.5, hold 1 to 3, ramp 0.5, rest 1 to 4, tare 2; a tare may need its two attempts
    assert plan.duration() == (2 + 0.5 + 2 + 0.5 + 1 + 2, 4 + 0.5 + 3 + 0.5 + 4 + 4)
    assert plan.peak() == 5.0
    assert Plan(Sine(3.0, (0.1,), 1, offset=-2.0), DWELL, 10.0).peak() == 5.0
    assert Plan(Ramp(7.0, 1.0), DWELL, 10.0).peak() == 7.0


def test_sweep_and_sine_are_steps_of_their_own():
    sweeps = [s for s in Plan(Ramp(6.0, 2.0), DWELL, 10.0) if s.swept]
    assert [(s.from_voltage, s.voltage, s.max_duration) for s in sweeps] == [(0, 6, 3), (6, -6, 6), (-6, 0, 3)]
    waves = [s for s in Plan(Sine(3.0, (0.1, 0.5), 2), DWELL, 10.0) if s.phase == "sine"]
    assert [(s.amplitude, s.frequency, s.max_duration) for s in waves] == [(3, 0.1, 20), (3, 0.5, 4)]


@given(
    st.lists(st.floats(-20, 20), min_size=1, max_size=8),
    st.integers(0, 4),
    st.integers(1, 3),
    st.floats(0.1, 100),
)
def test_every_plan_is_continuous_and_ends_at_zero(voltages, zero_every, repeats, slew):
    steps = list(Plan(Levels(tuple(voltages)), DWELL, slew, repeats=repeats, zero_every=zero_every))
    at = 0.0
    for step in steps:
        start = step.from_voltage if step.phase == "ramp" else step.voltage
        assert start == at
        at = step.voltage
        if step.phase == "ramp":
            assert abs(step.voltage - step.from_voltage) == pytest.approx(slew * step.max_duration)
    assert [s.index for s in steps] == list(range(len(steps)))
    assert (steps[0].phase, steps[-1].phase, at) == ("tare", "tare", 0.0)
    assert len([s for s in steps if s.phase == "hold"]) == len(voltages) * repeats


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: FixedDwell(-1.0), "dwell.duration must be a number above 0 s, but is -1"),
        (lambda: FixedDwell(nan), "dwell.duration must be a number above 0 s, but is nan"),
        (lambda: FixedDwell(1.0, settle=1.0), r"dwell.settle \(1 s\) must be shorter"),
        (lambda: SteadyDwell(3.0, 2.0, 0.1, 0.1), r"dwell.min \(3 s\) must not exceed dwell.max \(2 s\)"),
        (lambda: SteadyDwell(1.0, 2.0, 0.0, 0.1), "dwell.max_std_error must be a number above 0 N"),
        (lambda: SteadyDwell(1.0, 2.0, 0.1, inf), "dwell.max_drift must be a number above 0 N/s"),
        (lambda: SteadyDwell(1.0, 2.0, 0.1, 0.1, settle=-1.0), "dwell.settle must be a number of at least 0 s"),
        (lambda: SteadyDwell(1.0, 2.0, 0.1, 0.1, settle=1.5), "must be shorter than dwell.min"),
        (lambda: Plan(Levels((1.0,)), DWELL, 0.0), "slew must be a number above 0 V/s, but is 0"),
        (lambda: Plan(Levels((1.0,)), DWELL, 1.0, repeats=0), "repeats must be at least 1"),
        (lambda: Plan(Levels((1.0,)), DWELL, 1.0, zero_every=-1), "zero_every must be at least 0"),
        (lambda: Plan(Levels((1.0,)), DWELL, 1.0, rest=-1.0), "rest must be a number of at least 0 s"),
        (lambda: TareConfig(0.0), "duration must be a number above 0 s"),
        (lambda: TareConfig(attempts=0), "attempts must be at least 1"),
        (lambda: Levels(()), "voltages must hold at least one level"),
        (lambda: Levels((1.0, nan)), "voltages must be finite numbers in V, but one is nan"),
        (lambda: Levels((1.0, 2.0), (1.0,)), "durations must hold one number for each of the 2 voltages, but holds 1"),
        (lambda: Levels((1.0,), (nan,)), "durations must be a number above 0 s, but is nan"),
        (lambda: Plan(Levels((1.0,), (0.5,)), DWELL, 1.0), r"dwell.settle \(0.5 s\) must be shorter than each of dur"),
        (lambda: Staircase(5.0, 0), "levels must be at least 1, but is 0"),
        (lambda: Staircase(-5.0, 2), "max must be a number above 0 V"),
        (lambda: Interleaved(5.0, 2, min=6.0), r"min \(6 V\) must not exceed max \(5 V\)"),
        (lambda: Interleaved(5.0, 2, min=0.0), "min must be a number above 0 V"),
        (lambda: RandomOrder(5.0, 2, seed=-1), "seed must be at least 0"),
        (lambda: Ramp(5.0, 0.0), "rate must be a number above 0 V/s"),
        (lambda: Sine(5.0, (), 1), "frequencies must hold at least one"),
        (lambda: Sine(5.0, (0.0,), 1), "frequencies must be a number above 0 Hz"),
        (lambda: Sine(5.0, (1.0,), 0), "cycles must be at least 1"),
        (lambda: Sine(5.0, (1.0,), 1, offset=inf), "offset must be a finite number"),
        (lambda: Plan(Sine(5.0, (1.0,), 1), DWELL, 10.0), "a sine of 5 V at 1 Hz needs 31.4 V/s, but the plan's slew"),
        (lambda: Plan(Ramp(5.0, 11.0), DWELL, 10.0), "a sweep at 11 V/s needs 11 V/s"),
    ],
)
def test_impossible_plans_are_refused(make, text):
    with pytest.raises(PlanError, match=text):
        make()


def test_limits_of_the_bench_are_kept():
    plan = Plan(Levels((5.0,)), DWELL, 10.0)
    plan.require_within(5.0, 10.0, "the bench")
    with pytest.raises(PlanError, match=r"step 2 \(ramp\) commands 5 V, but the bench allows at most 4 V"):
        plan.require_within(4.0, 10.0, "the bench")
    with pytest.raises(PlanError, match="slew is 10 V/s, but the bench allows at most 9 V/s"):
        plan.require_within(5.0, 9.0, "the bench")


def test_sine_command_keeps_its_slew():
    wave = next(s for s in Plan(Sine(3.0, (0.5,), 1), DWELL, 10.0) if s.phase == "sine")
    t = np.linspace(0, wave.max_duration, 10_001)
    command = wave.voltage + wave.amplitude * np.sin(2 * np.pi * wave.frequency * t)
    assert np.abs(np.diff(command) / np.diff(t)).max() <= 10.0


@pytest.mark.parametrize(
    "made",
    [
        lambda: Plan(Staircase(6.0, 10**9), DWELL, 10.0),
        lambda: Plan(RandomOrder(6.0, 10**12, seed=1), DWELL, 10.0),
        lambda: Plan(Levels((1.0, 2.0)), DWELL, 10.0, repeats=10**15),
        lambda: Plan(Sine(1.0, (0.1,), 10**18), DWELL, 10.0),
        lambda: Plan(Levels((1.0,), (1e300,)), DWELL, 10.0),
        lambda: Plan(Ramp(1.0, 1e-300), DWELL, 10.0),
    ],
    ids=range(6),
)
def test_what_would_never_end_is_refused_before_it_is_spread_out(made):
    with pytest.raises(PlanError, match=r"at most|are allowed"):
        made()
