"""Errors on motion that was not fitted: of whole runs, of runs in turn, and of blocks of the only one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from identification.mismatch.diagnosis import HeldOutRmse
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.validate.held_out import fitted_blocks
from identification.mismatch.vehicle.free_force import judge_left, with_free_force
from identification.mismatch.vehicle.judging import better_predicting, held_out, noise_rms, only, residuals, rms
from identification.mismatch.vehicle.runs import Prepared
from identification.mismatch.vehicle.search import State
from identification.physics.vehicle.dead_band import DeadBand
from identification.physics.vehicle.linear_drag import LinearDrag
from tests.identification.mismatch.vehicle.boats import (
    NOISE,
    banded,
    boat,
    orders,
    part,
    prepared,
    speed_at,
    state,
    weak_at_8,
)

BAND, STRAIGHT = DeadBand(), LinearDrag()
WIDTH = 1.0
"""V, of 12."""
OTHER = (12.0, -8.0, 10.0, 3.0, -12.0, 8.0)


@pytest.fixture(scope="module")
def runs() -> Prepared:
    made = [boat(i, banded(WIDTH), levels) for i, levels in enumerate(orders(3))]
    return prepared([*made, boat(9, banded(WIDTH), OTHER, v0=1.1)])


@pytest.fixture(scope="module")
def states(runs: Prepared) -> tuple[State, State]:
    data = part(runs, 0, 1, 2)
    return state(data), state(data, {BAND: (0.5,)})


def test_sums_are_over_all_samples_of_all_runs() -> None:
    assert rms([np.array([3.0, 0.0]), np.array([0.0, 4.0])]) == pytest.approx(2.5)
    assert noise_rms(Noise(9.0, 0.5, (1.0,), (16.0,))) == 5.0


def test_a_residual_is_measured_less_predicted(runs: Prepared, states: tuple[State, State]) -> None:
    data = part(runs, 0, 1, 2)
    for run, left in zip(data.runs, residuals(states[1].fit, data), strict=True):
        at = int(run.recording_id[-1])
        true = speed_at(run.time, orders(3)[at], banded(WIDTH))
        assert left == pytest.approx(run.response - true, abs=NOISE)
        assert np.std(left - (run.response - true)) < 0.1 * NOISE
    assert only(runs, data.runs).runs == data.runs


def test_a_run_that_was_given_for_it_is_simulated_from_its_commands(
    runs: Prepared, states: tuple[State, State]
) -> None:
    """Of the model without a dead band scipy's motion tells the error: its drag, and the speed at the start found
    on the run itself."""
    before, after = states
    unseen = part(runs, 3)
    held = held_out(before, after, part(runs, 0, 1, 2), unseen)
    assert held.after == pytest.approx(NOISE, rel=0.1)
    assert held.noise == pytest.approx(NOISE)
    (run,) = unseen.runs

    def left(v0: float) -> float:
        return rms([run.response - speed_at(run.time, OTHER, v0=v0, drag=float(before.fit.theta[0]))])

    least = minimize_scalar(left, bounds=(0.5, 1.5), method="bounded", options={"maxiter": 8}).fun
    assert held.before == pytest.approx(least, rel=0.02)
    assert held.before > 3 * held.after
    assert "boat-9" in held.what
    assert not held.grown


def test_runs_are_left_out_in_turn_where_there_are_several(runs: Prepared, states: tuple[State, State]) -> None:
    held = held_out(*states, part(runs, 0, 1, 2), None)
    assert held.after == pytest.approx(NOISE, rel=0.1)
    assert held.before > 2 * held.after
    assert held.what.startswith("each run in turn simulated by a model fitted to the others")


def test_each_of_them_is_predicted_by_the_others_alone(runs: Prepared, states: tuple[State, State]) -> None:
    """As if it had been given for it; one is of another dead band, which the others must not know of."""
    odd = prepared(
        [boat(i, banded(w), levels) for i, (w, levels) in enumerate(zip((1.0, 2.5, 1.0), orders(3), strict=True))]
    )
    data = part(odd, 0, 1, 2)
    whole = state(data), state(data, {BAND: (0.5,)})
    squares, samples = np.zeros(2), 0
    for j in range(3):
        others, one = part(odd, *({0, 1, 2} - {j})), part(odd, j)
        held = held_out(state(others), state(others, {BAND: (0.5,)}), others, one)
        samples += one.runs[0].time.size
        squares += one.runs[0].time.size * np.array([held.before, held.after]) ** 2
    held = held_out(*whole, data, None)
    assert [held.before, held.after] == pytest.approx(np.sqrt(squares / samples).tolist(), rel=1e-3)


def test_what_is_kept_back_of_a_run_is_not_fitted_and_is_judged(runs: Prepared) -> None:
    """The blocks that are kept back are read half a metre a second too high: the error is that, and no less."""
    one = boat(0, banded(WIDTH), orders(1)[0])
    command, speed = one.channels
    spoilt = replace(speed, value=speed.value + 0.5 * ~fitted_blocks(speed.time))
    data = prepared([replace(one, channels=(command, spoilt))])
    model = state(part(runs, 0), {BAND: (0.5,)})
    held = held_out(model, model, data, None)
    assert held.after == pytest.approx(0.5, abs=0.02)


def test_blocks_of_the_only_run_are_kept_back(runs: Prepared) -> None:
    data = part(runs, 0)
    before, after = state(data), state(data, {BAND: (0.5,)})
    held = held_out(before, after, data, None)
    assert held.what.startswith("every fourth block of time")
    assert held.after == pytest.approx(NOISE, rel=0.15)
    assert held.before > 2 * held.after
    rows = int(held.what.split(", ")[1].split()[0])
    assert rows == pytest.approx(0.25 * data.runs[0].time.size, rel=0.1)


def test_a_model_beside_itself_is_no_better_and_has_not_grown(runs: Prepared, states: tuple[State, State]) -> None:
    _, after = states
    held = held_out(after, after, part(runs, 0, 1, 2), part(runs, 3))
    assert held.before == held.after
    assert not held.grown


def test_a_model_that_predicts_worse_has_grown(runs: Prepared) -> None:
    """Fitted to slow levels alone, where a drag in proportion does for the dead band, and judged on fast ones."""
    slow = prepared([boat(i, banded(2.0), (3.0, -3.0, 3.0, 2.5, -3.0)) for i in range(2)])
    data = part(slow, 0, 1)
    before, after = state(data, {BAND: (1.0,)}), state(data, {STRAIGHT: (5.0,)})
    unseen = part(prepared([boat(5, banded(2.0), OTHER)]), 0)
    held = held_out(before, after, data, unseen)
    assert held.after > 2 * held.before
    assert held.grown


def test_another_model_takes_the_place_only_where_it_predicts_better(
    runs: Prepared, states: tuple[State, State]
) -> None:
    before, after = states
    data, unseen = part(runs, 0, 1, 2), part(runs, 3)
    held = held_out(before, after, data, unseen)
    assert better_predicting(before, (held, after), before, data, unseen) == (held, after)
    poor = HeldOutRmse(held.before, held.before, held.noise, "")
    told, chosen = better_predicting(before, (poor, before), after, data, unseen)
    assert chosen is after
    assert told.after == pytest.approx(held.after)


def test_a_free_force_goes_with_the_command_of_the_run_it_predicts() -> None:
    made = prepared([boat(i, weak_at_8, levels) for i, levels in enumerate(orders(3))])
    data, unseen = part(made, 0, 1), part(made, 2)
    before = state(data)
    left = judge_left(before.fit, before.white, data, np.random.default_rng(0))
    free = with_free_force(before, data, left.structures[0])
    held = held_out(before, free, data, unseen)
    assert left.structures[0].covariate.quantity == "command_voltage"
    assert held.after < 0.3 * held.before
    assert held.after < 2 * NOISE
