"""The next experiment: what its pieces are, what it promises, and that it settles what could not be told before."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.diagnosis import Diagnosis, PlanStep
from identification.mismatch.model.parameters import Layout
from identification.mismatch.next_experiment.discrimination import distances, pieces, power
from identification.mismatch.next_experiment.predicted_response import (
    AFTER_STEP,
    Bench,
    PredictedResponse,
    ending,
    intervals,
    one_zero,
    stretches,
)
from identification.mismatch.next_experiment.sweeps import REST, Block, Limits, blocks, put_together, round_level
from identification.mismatch.pipeline import diagnose
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.select.forward_selection import search
from identification.recording import Channel, Recording
from tests.identification.diagnosed_runs import run

RATE, HOLD, TOP, C, NOISE = 40.0, 3.0, 20.0, 0.4, 1.2
LEVELS = (0.0, 10.0, -10.0, 15.0, -15.0, 20.0, -20.0, 0.0)


def recording(name, volts, seconds, flow=None, exponent=1.97, seed=0, rounds=1, even=0.0, turning=False):
    """Thrust C top^2 (V/top)^p of a plan, levels reached at once, sampled between the changes."""
    rng = np.random.default_rng(seed)
    volts, seconds = np.tile(volts, rounds), np.tile(seconds, rounds)
    ends = np.cumsum(seconds)
    t = np.arange(0.0, ends[-1], 1 / RATE) + 0.5 / RATE
    V = volts[np.minimum(np.searchsorted(ends, t), volts.size - 1)]
    F = C * TOP**2 * np.sign(V) * np.abs(V / TOP) ** exponent + even * C * V**2 + 1.0 + rng.normal(0.0, NOISE, t.size)
    starts = np.concatenate([[0.0], ends[:-1]])
    channels = [
        Channel("command", "command", "command_voltage", "V", starts, volts.astype(float)),
        Channel("thrust", "cell", "thrust", "N", t, F),
    ]
    if flow is not None:
        channels.append(Channel("flow", "flow", "flow_speed", "m/s", t, np.where(t < ends[-1] / 2, 0.0, flow)))
    if turning:
        channels.append(
            Channel("n", "motor", "rotation_rate", "rev/s", t[::2], 2 * V[::2] + rng.normal(0, 0.1, t[::2].size))
        )
        channels.append(Channel("bus", "motor", "bus_voltage", "V", t[::2], 24.0 - (V[::2] / TOP) ** 2))
    return Recording(name, "T1", tuple(channels))


def first(**changes):
    return recording("first", np.array(LEVELS), np.full(len(LEVELS), HOLD), rounds=4, **changes)


@pytest.fixture(scope="module")
def unsettled():
    return diagnose([first()])


def test_ambiguous_answer_comes_with_a_sweep_within_limits(unsettled):
    assert unsettled.verdict == "ambiguous"
    found = unsettled.next_experiment
    assert found.why.startswith(f"separates {unsettled.findings[0].effect} from ")
    assert 0.0 <= found.expected_power <= 1.0
    assert sum(step.duration for step in found.steps) <= 300.0
    volts = [step.command_voltage for step in found.steps]
    assert max(map(abs, volts)) <= TOP
    assert volts[0] == volts[-1] == 0.0
    assert {step.flow_speed for step in found.steps} == {0.0}


def test_the_same_recording_gives_the_same_sweep(unsettled):
    again = diagnose([first()]).next_experiment
    assert again == unsettled.next_experiment


def test_the_sweep_settles_it(unsettled):
    steps = unsettled.next_experiment.steps
    volts = np.array([step.command_voltage for step in steps])
    second = recording("second", volts, np.array([step.duration for step in steps]), seed=1)
    settled = diagnose([first(), second])
    assert settled.verdict == "explained"
    assert [f.effect for f in settled.findings] == ["exponent"]


def test_limits_are_kept_and_flow_speeds_used():
    limits = Limits(max_voltage=12.0, budget=60.0, flow_speeds=(0.5,), slew=24.0, max_thrust=40.0)
    found = diagnose([first(flow=0.5)], limits=limits).next_experiment
    assert max(abs(step.command_voltage) for step in found.steps) <= np.sqrt(40.0 / C) + 0.2
    assert ending(found.steps, 24.0)[-1] <= 60.0
    assert {step.flow_speed for step in found.steps} <= {0.0, 0.5}


def test_a_budget_too_short_for_anything_still_gives_the_shortest_piece():
    found = diagnose([first()], limits=Limits(budget=1.0)).next_experiment
    assert found.expected_power < 0.5
    assert "takes" in found.why


def test_nothing_to_separate_nothing_proposed():
    assert diagnose([first(exponent=2.0)]).next_experiment is None


def test_rivals_that_no_sweep_separates_are_said_so():
    """An even difference of the two directions, and a cell that feels the torque, are one family on thrust alone."""
    found = diagnose([first(exponent=2.0, even=0.02)]).next_experiment
    assert found.expected_power < 0.05
    told = "asymmetry is like torque_crosstalk (the torque channel, or dead weights on the cell would tell)"
    assert found.why == f"within these limits {told}"
    assert found.steps == ()


def test_other_channels_are_foreseen():
    """A rate that is a second response, and a bus voltage that sags with the power."""
    found = search((history_of(first(turning=True)),), np.random.default_rng(0))
    bench = Bench(found.after, found.data, 24.0)
    assert bench.sampling == pytest.approx(RATE, rel=0.05)
    steps = (PlanStep(0.0, 3.0), PlanStep(TOP, 3.0), PlanStep(0.0, 3.0, 0.5))
    still, moving = bench.rehearsed(stretches(steps)).histories
    assert still.rate_count.sum() == pytest.approx(20.0 * still.edges[-1], rel=0.1)
    bus = still.others["bus_voltage"]
    assert bus[still.driver == TOP].mean() == pytest.approx(23.0, abs=0.1)
    assert bus[still.driver == 0.0].mean() == pytest.approx(24.0, abs=0.1)
    assert moving.driver[-1] == 0.0
    views, where = bench.outlook([found.after.fit], stretches(steps))
    assert (
        views[0].value.size
        == where.shape[0]
        == still.rows.size + moving.rows.size + sum(h.rate_rows.size for h in (still, moving))
    )


def test_levels_are_round():
    assert round_level(13.37, 20.0) == 13.4
    assert round_level(-3.333, 48.0) == -3.4
    assert round_level(0.234, 1.0) == pytest.approx(0.235, abs=0.005)
    assert round_level(19.43, 19.43) == 19.4
    assert round_level(-19.43, 19.43) == -19.4, "never beyond what was recorded"


def test_blocks_hold_no_more_than_the_largest():
    every = blocks(20.0, (0.5,))
    assert max(abs(volts) for block in every for volts, _ in block.holds) == 20.0
    assert {block.flow for block in every} == {0.0, 0.5}
    assert len(set(every)) == len(every)
    loads = [s for block in every for volts, s in block.holds if abs(volts) > 0.9 * 20.0]
    assert max(loads) <= 10.0  # no minutes at full voltage


def test_repeated_blocks_come_in_rounds_and_rests_are_not_doubled():
    one, two = Block("", ((5.0, 2.0), (-5.0, 2.0))), Block("rest", ((0.0, 60.0),))
    moving = Block("flow", ((0.0, REST), (5.0, 2.0)), 0.5)
    steps = put_together([moving, one, two, one], [one, two, moving])
    assert [(s.command_voltage, s.duration, s.flow_speed) for s in steps] == [
        *((0.0, REST, 0.0), (5.0, 2.0, 0.0), (-5.0, 2.0, 0.0), (0.0, 60.0, 0.0), (5.0, 2.0, 0.0), (-5.0, 2.0, 0.0)),
        *((0.0, REST, 0.0), (0.0, REST, 0.5), (5.0, 2.0, 0.5), (0.0, REST, 0.5)),
    ]
    assert [len(part) for part in stretches(steps)] == [7, 3]


def test_equal_levels_that_meet_are_held_on():
    one, two = Block("a", ((5.0, 2.0),)), Block("b", ((5.0, 3.0),))
    assert [s.duration for s in put_together([one, two], [one, two])] == [REST, 5.0, REST]


def test_intervals_of_a_plan_follow_its_slew():
    steps = [PlanStep(0.0, 1.0), PlanStep(6.0, 2.0), PlanStep(-6.0, 1.0)]
    dt, driver, blind = intervals(steps, 12.0)
    assert dt.sum() == pytest.approx(ending(steps, 12.0)[-1]) == pytest.approx(5.5)
    assert dt @ driver == pytest.approx(0.5 * 0.5 * 6.0 + 12.0 - 6.0)
    assert dt[blind].max() <= AFTER_STEP * 1.001
    at_once, _, _ = intervals(steps, float("inf"))
    assert at_once.sum() == pytest.approx(4.0)


def test_distance_is_what_the_wrong_model_cannot_follow():
    rng = np.random.default_rng(3)
    views = [
        PredictedResponse(rng.normal(size=50), rng.normal(size=(50, 2)), np.diag([0.5, 2.0]), Layout((), (), 0))
        for _ in range(2)
    ]
    block = np.repeat([0, 1, -1], [20, 25, 5])
    both = pieces(views, block, 2)
    total = both[0] + both[1]
    d = (views[0].value - views[1].value)[:45]
    J = views[1].slopes[:45]
    expected = d @ np.linalg.solve(np.eye(45) + J @ views[1].cov @ J.T, d)
    assert distances(total)[0, 0, 1] == pytest.approx(expected)
    assert distances(total)[0, 0, 0] == 0.0


def test_power_of_models_alike_and_far_apart():
    slopes, cov = np.ones((100, 1)), np.eye(1)
    flat = PredictedResponse(np.zeros(100), slopes, cov, Layout((), (), 0))
    assert power(flat, flat, 4.0) == 0.0
    far = replace(flat, value=np.where(np.arange(100) % 2, 1.0, -1.0))
    assert power(flat, far, 4.0) > 0.99
    followed = replace(flat, value=np.full(100, 0.5))  # within what the other's free parameter does
    assert power(flat, followed, 4.0) < 0.1


def test_one_zero_for_all_runs():
    slopes = np.arange(24.0).reshape(4, 6)
    view = one_zero(PredictedResponse(np.zeros(4), slopes, np.eye(6), Layout((), (), 2)))
    assert view.slopes.shape == (4, 5)
    assert view.slopes[:, 1].tolist() == (slopes[:, 1] + slopes[:, 2]).tolist()
    assert view.cov.shape == (5, 5)


def test_where_nothing_that_may_be_driven_tells_them_apart_there_is_no_sweep():
    """Asymmetry and cross-talk are one curve: a sweep of four steps was said to separate them."""
    found = diagnose([run(change=lambda _t, V, F: np.where(V < 0, 0.9 * F, F), noise=0.1)])
    assert isinstance(found, Diagnosis)
    assert found.verdict == "ambiguous"
    assert found.next_experiment is not None
    assert found.next_experiment.steps == ()
    told = "within these limits asymmetry is like torque_crosstalk (the torque channel, or dead weights on the cell"
    assert told in found.next_experiment.why
    assert "No sweep settles it: within these limits asymmetry is like torque crosstalk" in found.statement
