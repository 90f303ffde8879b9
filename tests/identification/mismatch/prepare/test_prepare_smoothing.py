"""A measured driver without its noise: levels are their means, curves are followed, jumps and kinks stay."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.prepare.adaptive_smoothing import smoothed
from tests.identification.mismatch.small import rng

NOISE = 0.1
T = 0.02 * np.arange(3000)


def course(value, jumps=(), seed=1):
    """What is made of a course with noise on it; `jumps` after these samples."""
    jumped = np.zeros(value.size - 1, dtype=bool)
    jumped[list(jumps)] = True
    return smoothed(T[: value.size], value + NOISE * rng(seed).standard_normal(value.size), jumped, NOISE)


def test_a_level_is_its_mean_with_the_error_of_a_mean():
    """A sample far out may cut it in two; over many levels the means are off by what their errors say."""
    off = []
    for seed in range(60):
        found = course(np.full(400, 3.0), seed=seed)
        assert sum(v.last - v.first for v in found.levels) > 300
        for level in found.levels:
            assert level.error == pytest.approx(NOISE / np.sqrt(level.last - level.first))
            here = slice(level.first, level.last)
            assert np.all(found.value[here] == level.value)
            assert np.all(found.error[here] == 0.0), "what it is off by is shared, and told with the level"
            off.append((level.value - 3.0) / level.error)
    assert np.std(off) == pytest.approx(1.0, abs=0.25)


def test_two_levels_are_apart_and_the_jump_is_sharp():
    value = np.where(np.arange(600) < 250, 1.0, 5.0)
    found = course(value, jumps=[249])
    assert not any(v.first < 250 < v.last for v in found.levels)
    for level in found.levels:
        assert level.value == pytest.approx(value[level.first], abs=4 * level.error)
        assert (level.begun, level.ended) == (T[level.first], T[level.last - 1])
    assert np.max(np.abs(found.value - value)[240:260]) < NOISE


@pytest.mark.parametrize(
    ("value", "least"),
    [(np.sin(2 * np.pi * T / 20), 3.0), (0.05 * T, 6.0), (np.exp(-T / 10), 3.0)],
    ids=["sine", "ramp", "decay"],
)
def test_a_course_that_moves_is_followed_with_far_less_noise(value, least):
    found = course(value)
    assert np.std(found.value - value) < NOISE / least
    assert abs(np.mean(found.value - value)) < 0.05 * NOISE
    moving = found.error > 0
    assert np.mean(np.abs(found.value - value)[moving] < 3 * found.error[moving] + 1e-9) > 0.97, "errors are honest"


def test_a_corner_is_not_rounded_off():
    """From rest into a ramp: a line through both would be off by many sigma of its own at the corner."""
    value = np.maximum(T - 30.0, 0.0) * 0.8
    found = course(value)
    near = np.abs(T - 30.0) < 1.0
    assert np.max(np.abs(found.value - value)[near]) < 2.5 * NOISE


def test_what_is_still_on_its_way_is_no_level():
    """A rotor that takes its time: the level begins where it has arrived, and its mean is not that of the way."""
    value = 5.0 * (1 - np.exp(-T[:1200] / 1.5))
    off = []
    for seed in range(15):
        level = course(value, seed=seed).levels[0]
        assert level.begun > 5.0
        off.append((level.value - 5.0) / level.error)
    assert abs(np.mean(off)) < 0.8


def test_a_slow_wander_is_no_level():
    found = course(0.3 * np.sin(2 * np.pi * T / 5.0))
    assert found.levels == ()
