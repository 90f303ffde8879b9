"""A threshold between levels that are nearer to each other than any fit can feel."""

import numpy as np
import pytest

from identification.mismatch.estimate.between_levels import sought
from identification.mismatch.pipeline import diagnose
from identification.mismatch.select.screening import refined
from identification.physics.dead_band import DeadBand
from identification.recording import Channel, Recording
from tests.identification.mismatch.small import estimated, known_noise

C, TOP, HOLD, NOISE = 0.5, 9.0, 0.5, 0.01
JUMP = DeadBand("jump")
STEP = 0.01
"""V between levels: 0.1 % of the largest."""
LOW = np.arange(0.3, 0.9, STEP)


def stairs(half_width: float) -> Recording:
    """Every 0.01 V from 0.3 to 0.9 V, up and down, beside levels of up to 9 V; the rotor at once."""
    low = np.random.default_rng(3).permutation(np.concatenate([LOW, -LOW]))
    level = np.concatenate([np.tile([0.0, TOP, 3.0, -TOP, -3.0, 6.0, -6.0], 4), low, [0.0]])
    start = HOLD * np.arange(level.size)
    t = np.arange(0.01, HOLD * level.size, 0.02)
    V = level[np.searchsorted(start, t, side="right") - 1]
    n = np.where(np.abs(V) > half_width, V, 0.0)
    F = C * n * np.abs(n) + np.random.default_rng(1).normal(0.0, NOISE, t.size)
    command = Channel("command_voltage", "command", "command_voltage", "V", start, level)
    return Recording("stairs", "T1", (command, Channel("thrust", "cell", "thrust", "N", t, F)))


@pytest.mark.parametrize("begun", [0.45, 0.6, 0.75])
def test_a_fit_finds_the_two_levels_between_which_it_lies(begun):
    _, found = estimated({JUMP: (begun,)}, [stairs(0.6151)])
    (half_width,) = found.fit.values[JUMP]
    assert 0.61 < half_width < 0.62
    assert found.fit.chi2 / found.fit.residual.size == pytest.approx(1.0, abs=0.1), "no level stands on the wrong side"


def test_a_trial_is_put_between_its_levels():
    data, found = known_noise({}, [stairs(0.7249)], NOISE)
    (half_width,) = refined(found.fit, data, found.weights, JUMP, (0.5,))
    assert 0.72 < half_width < 0.73


def test_of_places_that_predict_the_same_the_middle():
    assert sought(0.6, 9.0, lambda place: 0.0 if 0.61 < place < 0.62 else 100.0) == pytest.approx(0.615, abs=0.002)


def test_no_further_than_is_possible():
    assert sought(0.6, 0.62, lambda place: -1e6 * place) == pytest.approx(0.62)


def test_a_run_with_a_jump_alone_has_nothing_else():
    said = diagnose([stairs(0.6151)])
    assert (said.verdict, [found.effect for found in said.findings]) == ("explained", ["dead_band"])
    low, high = said.findings[0].parameters["half_width"].interval
    assert low <= 0.6151 <= high
    assert high - low < 2.0 * STEP
