import numpy as np
import pytest

from identification.recording import Channel, Recording, Step
from identification.steady_state.holds import from_steps, from_voltage, overlap_free
from identification.steady_state.points import find_windows, reduce_to_points, resolution, voltage_channel
from tests.identification.thrust_runs import LEVELS, level_table, sine, staircase


def points_of(recording):
    return reduce_to_points(recording, voltage_channel(recording), recording.first_of("thrust"))


@pytest.mark.parametrize("kind", [{"steps": True}, {"steps": False}, {"steps": False, "dense": True}])
def test_one_point_per_hold_however_the_holds_are_told(kind):
    points = points_of(staircase(**kind))
    assert points.voltage == pytest.approx(LEVELS)
    expected = 0.4 * np.array(LEVELS) * np.abs(LEVELS) + 1.5
    assert np.all(np.abs(points.thrust - expected) < 5 * points.std_error)
    assert points.unsteady == 0
    assert {p.thrust.n for p in points.points} <= set(range(50, 101))


def test_settling_is_left_out():
    points = points_of(staircase(tau=0.15, hold=4.0))
    expected = 0.4 * np.array(LEVELS) * np.abs(LEVELS) + 1.5
    assert points.thrust == pytest.approx(expected, abs=0.15)
    driven = [p.thrust.t_start % 4 for p in points.points if abs(p.voltage) > 0]
    assert min(driven) > 0.5


def test_missing_samples_are_skipped_and_counted():
    def gaps(t, V, F):
        return np.where((t > 3) & (t < 3.5), np.nan, F)

    points = points_of(staircase(mend=gaps))
    assert points.skipped == 24
    assert np.all(np.isfinite(points.thrust))


def test_a_hold_without_a_single_sample_is_left_out():
    points = points_of(staircase(mend=lambda t, V, F: np.where((t >= 2) & (t < 4), np.nan, F)))
    assert len(points.points) == len(LEVELS) - 1


def test_drifting_hold_is_not_steady():
    points = points_of(staircase(mend=lambda t, V, F: F + np.where((t >= 12) & (t < 14), 6 * (t - 12), 0.0)))
    assert [p.steady for p in points.points].count(False) == 1


def test_sine_and_level_tables_have_no_holds():
    assert points_of(sine()) is None
    assert points_of(level_table([-1, 0, 1], [-2, 0, 2])) is None


def test_measured_voltage_alone_with_noise_is_cut_into_holds():
    run = staircase(steps=False)
    t = run.channels[1].time
    V = run.channels[0].held_at(t) + np.random.default_rng(1).normal(0, 0.01, t.size)
    seen = Channel("u", "motor", "motor_voltage", "V", t, V)
    points = points_of(Recording("r", "T1", (seen, run.channels[1])))
    assert len({round(v) for v in points.voltage}) == len(set(LEVELS))
    marked = Recording("r", "T1", (seen, run.channels[1]), steps=staircase().steps)
    assert points_of(marked).voltage == pytest.approx(LEVELS, abs=0.01)


def test_quantised_rest_is_not_known_better_than_its_digit():
    def digits(t, V, F):
        return np.where(V == 0, 1.5, np.round(F, 1))

    points = points_of(staircase(mend=digits))
    rest = points.std_error[points.voltage == 0]
    assert rest == pytest.approx(np.full(rest.size, 0.1 / np.sqrt(12)), rel=1e-6)
    assert resolution([np.ones(3)]) == 0.0


def test_steps_that_overlap_or_show_one_level_are_not_believed():
    run = staircase()
    one = Recording("r", "T", run.channels, steps=run.steps[:1])
    channels = run.channels
    assert len(find_windows(one, *channels)) == len(LEVELS)
    twice = Recording("r", "T", channels, steps=(run.steps[0], run.steps[1], Step(9, "hold", 3.0, 0.5, 1.0)))
    assert not overlap_free(from_steps(twice))
    assert len(find_windows(twice, *channels)) == len(LEVELS)


def test_phases_that_are_no_holds_and_broken_rows_are_left_out():
    ramp, empty = Step(0, "ramp", 1.0, 0, 1), Step(1, "hold", 1.0, 2, 2)
    steps = (ramp, empty, Step(2, "hold", np.nan, 2, 3), Step(3, "tare", 0.0, 3, 4))
    assert [w.phase for w in from_steps(Recording("r", "T", (), steps=steps))] == ["tare"]


def test_nan_commands_end_a_run():
    t = np.arange(4.0)
    command = Channel("u", "c", "command_voltage", "V", t, np.array([1.0, np.nan, 1.0, 1.0]))
    assert [(w.t_start, w.t_end) for w in from_voltage(command, np.array([0.5, 2.5, 5.0]))] == [
        (0, 1),
        (2, pytest.approx(5)),
    ]
    nothing = Channel("u", "c", "command_voltage", "V", t, np.full(4, np.nan))
    assert from_voltage(nothing, t) == ()


def test_voltage_falls_back_to_what_was_measured():
    t = np.arange(3.0)
    empty = Channel("u", "c", "command_voltage", "V", t, np.full(3, np.nan))
    seen = Channel("m", "c", "motor_voltage", "V", t, np.ones(3))
    assert voltage_channel(Recording("r", "T", (empty, seen))) is seen
    assert voltage_channel(Recording("r", "T", (empty,)), "motor_voltage") is None
    no_thrust = Channel("f", "c", "thrust", "N", np.empty(0), np.empty(0))
    assert find_windows(Recording("r", "T", (seen, no_thrust)), seen, no_thrust) == ()


def test_level_of_a_measured_voltage_with_gaps():
    run = staircase(levels=(0.0, 5.0), hold=2.0)
    sparse = Channel("m", "c", "motor_voltage", "V", np.array([0.0, 1.999]), np.array([0.1, 5.1]))
    points = reduce_to_points(run, sparse, run.channels[1])
    assert points.voltage == pytest.approx([2.6, 5.1], abs=2.6)
