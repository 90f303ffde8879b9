"""The sweep that tells rivals apart: its pieces, and what they tell beside dense algebra."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from identification.mismatch import policy
from identification.mismatch.diagnosis import (
    PlanStep,
)
from identification.mismatch.model.parameters import Layout
from identification.mismatch.name.naming import name
from identification.mismatch.next_experiment import stage
from identification.mismatch.next_experiment.discrimination import distances, pieces, power
from identification.mismatch.next_experiment.predicted_response import Bench, PredictedResponse, ending, intervals
from identification.mismatch.next_experiment.proposal import largest_level, propose, rivals_of
from identification.mismatch.next_experiment.sweeps import BUDGET, REST, Limits, blocks, put_together, round_level
from identification.mismatch.next_experiment.two_levels import SECOND_LEVEL, two_levels
from identification.mismatch.periodic.periodic_disturbances import Line
from identification.physics.asymmetry import Asymmetry
from identification.physics.dead_band import DeadBand
from identification.physics.linear_term import LinearTerm
from identification.physics.torque_crosstalk import TorqueCrosstalk
from tests.identification.diagnosed_runs import TOP
from tests.identification.mismatch.small import known_noise, rng, short

UNEVEN, TWIST = Asymmetry(), TorqueCrosstalk()


EQUAL = policy.select.RIVALS_EQUAL_BIC


def view(seed, n=60, q=3):
    """A whitened prediction with its slopes and what the data in hand leave open."""
    draw = rng(seed)
    root = draw.standard_normal((q, q))
    return PredictedResponse(draw.standard_normal(n), draw.standard_normal((n, q)), root @ root.T, Layout((), (), 1))


def distance(true, wrong):
    """d' (I + J S J')^-1 d, dense."""
    d = true.value - wrong.value
    return float(d @ np.linalg.solve(np.eye(d.size) + wrong.slopes @ wrong.cov @ wrong.slopes.T, d))


@pytest.mark.parametrize("seed", range(4))
def test_distances_are_those_of_the_dense_covariance_and_add_up_over_blocks(seed):
    views = [view(10 * seed + i) for i in range(3)]
    block = rng(seed).integers(-1, 4, 60)
    found = pieces(views, block, 4)

    def part(v, rows):
        return PredictedResponse(v.value[rows], v.slopes[rows], v.cov, v.layout)

    every = found[0] + found[1] + found[2] + found[3]
    used = block >= 0
    for a in range(3):
        for b in range(3):
            for k in range(4):
                expected = distance(part(views[a], block == k), part(views[b], block == k))
                assert distances(found)[k, a, b] == pytest.approx(expected, abs=1e-8)
            whole = distance(part(views[a], used), part(views[b], used))
            assert distances(every)[0, a, b] == pytest.approx(whole, abs=1e-8)
    even = distances(found.evenly(0.5))[0]
    assert np.all(even <= distances(every)[0] + 1e-9)


def test_power_is_that_of_a_normal_where_nothing_is_open():
    """Chi-square apart is normal with twice the root of its mean."""
    for apart in (4.0, 12.0, 25.0):
        true = replace(view(1), cov=np.zeros((3, 3)))
        shift = rng(2).standard_normal(60)
        wrong = replace(true, value=true.value + shift * np.sqrt(apart) / np.linalg.norm(shift))
        expected = norm.sf((EQUAL - apart) / (2 * np.sqrt(apart)))
        assert power(true, wrong, EQUAL) == pytest.approx(expected, abs=0.06)


def test_what_the_wrong_model_can_follow_is_no_power():
    """The difference along a slope that the data in hand leave wide open."""
    true = view(3)
    wrong = replace(true, value=true.value + 5 * true.slopes[:, 0], cov=1e8 * np.eye(3))
    assert power(replace(true, cov=np.zeros((3, 3))), wrong, EQUAL) < 0.1
    sure = replace(wrong, cov=np.zeros((3, 3)))
    assert power(replace(true, cov=np.zeros((3, 3))), sure, EQUAL) > 0.95


@settings(max_examples=60, deadline=None)
@given(st.floats(0.01, 1e4), st.floats(-1.0, 1.0))
def test_levels_are_round_and_within(largest, share):
    found = round_level(share * largest, largest)
    assert abs(found) <= largest * (1 + 1e-9)
    assert abs(found - share * largest) <= largest / 100 + 1e-6
    if largest >= 0.1:
        assert len(f"{abs(found):.6g}".replace(".", "").strip("0")) <= 4


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(0, 30), min_size=1, max_size=6), st.floats(1.0, 100.0))
def test_a_sweep_holds_all_that_was_chosen_and_begins_and_ends_at_rest(chosen, largest):
    every = blocks(largest, (0.5,))
    picked = [every[k % len(every)] for k in chosen]
    steps = put_together(picked, every)
    assert steps[0].command_voltage == steps[-1].command_voltage == 0.0
    assert all(a != b for a, b in pairwise(steps))
    flows = [s.flow_speed for s in steps]
    assert flows == sorted(flows), "still water first, each flow once"
    wanted = {}
    for block in picked:
        for volts, seconds in block.holds:
            if volts:
                wanted[block.flow, volts] = wanted.get((block.flow, volts), 0.0) + seconds
    held = {}
    for s in steps:
        if s.command_voltage:
            key = s.flow_speed, s.command_voltage
            held[key] = held.get(key, 0.0) + s.duration
    assert held == pytest.approx(wanted)


def test_a_plan_takes_its_holds_and_the_ways_between():
    steps = (PlanStep(0.0, 3.0), PlanStep(10.0, 2.0), PlanStep(-10.0, 2.0))
    assert ending(steps, 5.0).tolist() == [3.0, 7.0, 13.0]
    assert ending(steps, np.inf).tolist() == [3.0, 5.0, 7.0]
    dt, driver, blind = intervals(steps, 5.0)
    assert dt.sum() == pytest.approx(13.0)
    assert float(driver @ dt) == pytest.approx(10 * 2.0 + 0.5 * 10 * 2 - 10 * 2.0)
    assert np.all(dt[blind] < 0.004)


@pytest.fixture(scope="module")
def rivals():
    """A difference of the directions, and a torque on the cell that does the same."""
    data, estimate = known_noise({UNEVEN: (1.0,)}, [short(change=lambda _t, V, F: np.where(V < 0, 0.9, 1.0) * F)])
    return data, estimate, name(estimate, data, [UNEVEN, TWIST])


def test_the_answer_and_its_rivals_are_the_contest(rivals):
    data, estimate, named = rivals
    contest = rivals_of(estimate, named)
    assert contest.names == ("asymmetry", "torque_crosstalk")
    assert contest.fits[0] is estimate.fit
    assert contest.losses[0] == 0.0
    assert rivals_of(estimate, [replace(n, rivals=()) for n in named]) is None
    assert propose(estimate, data, [replace(n, rivals=()) for n in named]) is None


def test_rivals_that_no_sweep_separates_are_told_what_else_would(rivals):
    data, estimate, named = rivals
    found = propose(estimate, data, named, Limits(budget=60.0))
    assert found.why.startswith("within these limits asymmetry is like torque_crosstalk (the torque channel, or dead ")
    assert found.expected_power < 0.2
    assert found.steps == ()


def test_rivals_that_levels_separate_get_levels_that_do():
    """A dead band and a line on the curve, on two levels alone: any third tells them apart."""
    band, straight = DeadBand(), LinearTerm()
    recording = short()
    command, thrust = recording.channels
    few = replace(command, value=np.where(np.abs(command.value) >= 10.0, command.value, 0.0))
    V = np.nan_to_num(few.held_at(thrust.time))
    x = np.sign(V) * np.maximum(np.abs(V) - 0.8, 0.0)
    value = 0.5 * x * np.abs(x) + 1.0 + 0.6 * rng(1).standard_normal(V.size)
    recording = replace(recording, channels=(few, replace(thrust, value=value)))
    data, estimate = known_noise({band: (0.5,)}, [recording], 0.6)
    named = name(estimate, data, [band, straight])
    assert [r.term.id for r in named[0].rivals] == ["linear_term"]
    found = propose(estimate, data, named)
    assert found.expected_power > 0.9
    volts = [s.command_voltage for s in found.steps]
    assert max(map(abs, volts)) <= TOP
    assert any(0 < abs(v) < 9.0 for v in volts), "a level that was not there"
    assert ending(found.steps, np.inf)[-1] <= BUDGET
    limited = propose(estimate, data, named, Limits(max_voltage=6.0, max_thrust=10.0))
    assert max(abs(s.command_voltage) for s in limited.steps) <= np.sqrt(10.0 / abs(estimate.fit.theta.C)) + 1e-9


def test_the_largest_level_is_the_least_of_all_limits(rivals):
    data, estimate, _ = rivals
    assert largest_level(data, estimate, Limits()) == pytest.approx(TOP)
    assert largest_level(data, estimate, Limits(max_voltage=5.0)) == 5.0
    assert largest_level(data, estimate, Limits(max_voltage=50.0)) == pytest.approx(TOP)
    C = estimate.fit.theta.C
    assert largest_level(data, estimate, Limits(max_thrust=8.0)) == pytest.approx(np.sqrt(8.0 / C))


def test_a_rehearsal_is_a_run_of_the_plan_without_measurements(rivals):
    data, estimate, _ = rivals
    bench = Bench(estimate, data, np.inf)
    assert bench.sampling == pytest.approx(8.0, rel=0.05)
    steps = [PlanStep(0.0, 3.0), PlanStep(6.0, 4.0), PlanStep(-6.0, 4.0)]
    (h,) = bench.rehearsed([steps]).histories
    assert h.edges[-1] == pytest.approx(11.0)
    assert h.count.sum() == pytest.approx(8 * 11, abs=2)
    assert set(h.driver.tolist()) == {0.0, 6.0, -6.0}
    (views,), where = bench.outlook([estimate.fit], [steps])
    V = h.driver[h.rows]
    F = estimate.fit.theta.C * V * np.abs(V) * np.where(V < 0, estimate.fit.values[UNEVEN][0], 1.0)
    assert views.value == pytest.approx(F * np.sqrt(h.count[h.rows]) / 0.3, rel=1e-3, abs=1e-6)
    assert where[:, 1] == pytest.approx(h.middle[h.rows])


def line(gain, rival_gain):
    other = None if rival_gain is None else line(rival_gain, None)
    return Line("fixed", 20.0, 0.01, None, None, 1.0, 0.1, None, None, 1e-9, gain, "", rival=other)


@pytest.mark.parametrize(("gain", "budget"), [(400.0, 300.0), (60.0, 300.0), (8.0, 300.0), (8.0, 40.0)])
def test_two_levels_last_until_the_wrong_kind_has_lost_enough(rivals, gain, budget):
    """Chi-square in proportion to the time; its probability by a normal."""
    data, estimate, _ = rivals
    found = two_levels(line(gain, gain), estimate, data, Limits(budget=budget))
    rest, first, second, last = found.steps
    assert (rest, last) == (PlanStep(0.0, REST), PlanStep(0.0, REST))
    assert second.command_voltage == pytest.approx(SECOND_LEVEL * first.command_voltage, rel=0.01)
    assert first.duration == second.duration
    seconds = sum(float(h.edges[-1] - h.edges[0]) for h in data.histories)
    apart = gain / seconds * first.duration
    enough = policy.next_experiment.LEVELS_APART_CHI2
    assert apart >= enough or first.duration >= min(120.0, 0.5 * (budget - 2 * REST))
    assert found.expected_power == pytest.approx(norm.sf((EQUAL - apart) / (2 * np.sqrt(apart))), abs=1e-6)
    assert "20 Hz" in found.why


def test_the_stage_asks_for_names_first_then_for_lines(rivals):
    data, estimate, named = rivals
    both = stage.run(estimate, data, named, [line(100.0, 99.0)], Limits(budget=40.0))
    assert both.why.startswith("within these limits asymmetry is like")
    lines = stage.run(estimate, data, [replace(n, rivals=()) for n in named], [line(100.0, 99.0)], None)
    assert lines.why.startswith("separates a line at 20 Hz")
    assert stage.run(estimate, data, [], [line(100.0, 10.0), line(100.0, None)], None) is None
