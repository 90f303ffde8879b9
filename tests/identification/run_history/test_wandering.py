"""What wanders slowly beside a curve of what drives it, seen through noise."""

import numpy as np
import pytest

from identification.run_history.splines import spline
from identification.run_history.wandering import Smoother

NODES = np.array([-20.0, -12.0, -5.0, 5.0, 12.0, 20.0])


def at_levels(std: float = 0.01, period: float = 20.0, noise: float = 0.002, seed: int = 3):
    """Times, levels of 4 s of six voltages, a curve of them, a share of them that comes and goes, and their sum."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 160.0, 0.04)
    level = rng.choice(NODES, 41)[(time / 4.0).astype(int)]
    curve, wander = 0.02 * np.abs(level), std * np.sin(2 * np.pi * time / period)
    return time, level, curve, wander, curve + level * wander + noise * rng.standard_normal(time.size)


def smoothed(time, level, measured):
    columns = spline(level, NODES, np.eye(NODES.size), 1)
    smoother = Smoother(time, columns, level, np.ones_like(time), measured)
    c, wander = smoother(measured, time)
    return smoother, columns @ c, wander


@pytest.mark.parametrize("seed", range(4))
def test_a_curve_is_not_made_of_what_came_by_while_a_level_was_held(seed):
    time, level, curve, wander, measured = at_levels(seed=seed)
    smoother, found, wandering = smoothed(time, level, measured)
    assert np.std(found + level * wandering - curve - level * wander) < 0.001
    assert np.std(wandering - wander) < 0.1 * np.std(wander)
    assert np.std(found - curve) < 0.1 * np.std(level * wander)
    assert smoother.law is not None
    assert smoother.law.noise == pytest.approx(0.002, rel=0.6), "18 times it where the curve is found first"


def test_rows_without_driver_tell_of_the_curve_alone():
    time, level, _, _, measured = at_levels()
    rest = time > 150.0
    level[rest], measured[rest] = 0.0, 0.3 + 0.002 * np.random.default_rng(0).standard_normal(np.count_nonzero(rest))
    nodes = np.sort([*NODES, 0.0])
    columns = spline(level, nodes, np.eye(nodes.size), 1)
    smoother = Smoother(time, columns, level, np.ones_like(time), measured)
    c, _ = smoother(measured, time)
    assert (columns @ c)[rest] == pytest.approx(0.3, abs=0.001)


def test_nothing_wanders_where_the_curve_tells_all():
    time, level, curve, _, _ = at_levels()
    smoother, found, wandering = smoothed(time, level, curve)
    assert smoother.law is None
    assert found == pytest.approx(curve, abs=1e-9)
    assert not wandering.any()
