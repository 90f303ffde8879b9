"""Flexible terms: knots where the shape is, and what a spline multiplies."""

from dataclasses import replace

import numpy as np
import pytest

from identification.flexible_terms.flexible import MULTIPLIERS, Flexible, turned
from identification.mismatch.unnamed.formula import monomials_of
from identification.mismatch.unnamed.spline_knot_selection import Moments, choose, heights, nodes_of
from identification.physics.term import Scale, TermContext
from identification.run_history.remembered import RememberedRun
from identification.run_history.splines import spline
from tests.identification.diagnosed_runs import C
from tests.identification.mismatch.unnamed.flexible_runs import history


def moments(x, y, noise, constant=False):
    """Of hats over x against y with white noise; constants are projected out unless they are part of the spline."""
    nodes = nodes_of(x)
    hats = spline(x, nodes, np.eye(nodes.size), 1) / noise
    if not constant:
        hats = hats - hats.mean(axis=0)
        y = y - y.mean()
    return Moments(nodes, hats.T @ hats, hats.T @ (y / noise), x.size, (constant,))


def fitted(x, y, noise=0.1):
    m = moments(x, y, noise)
    found = choose(m)
    knots = m.nodes[list(found.knots)]
    values = heights(m, found.knots, found.degree, [tuple(range(1, len(found.knots)))])
    return found, knots, spline(x, knots, np.array([0.0, *values]), found.degree)


def test_a_wave_takes_a_cubic_with_knots_along_it():
    x = np.linspace(0.0, 10.0, 1500)
    y = np.sin(x)
    found, knots, curve = fitted(x, y + 0.1 * np.random.default_rng(1).standard_normal(x.size))
    assert found.degree == 3
    assert 5 <= knots.size <= 12
    assert np.std(curve - y) < 0.02


def test_a_jump_takes_a_broken_line_with_two_knots_close_together():
    x = np.linspace(0.0, 10.0, 1500)
    y = np.where(x < 6.3, 0.0, 1.0)
    found, knots, curve = fitted(x, y + 0.1 * np.random.default_rng(1).standard_normal(x.size))
    assert found.degree == 1
    assert np.min(np.abs(knots - 6.3)) < 0.3
    assert np.std(curve - y) < 0.1


def test_noise_takes_no_knots_and_gains_nothing():
    x = np.linspace(0.0, 10.0, 1500)
    found, knots, _ = fitted(x, 0.1 * np.random.default_rng(3).standard_normal(x.size))
    assert found.gain < 0
    assert knots.size == 2


def test_levels_are_nodes_and_zero_stays_one():
    assert nodes_of(np.repeat([-2.0, 1.0], 20), (0.0,)).tolist() == [-2.0, 0.0, 1.0]
    assert nodes_of(np.linspace(-1, 1, 5000), (0.0,)).size <= 66


SCALE = Scale(8.0, "V", 32.0, 20.0, 0.5)


def lagging(F, dt, tau, parts=2000):
    """Means over intervals of y' = (F - y)/tau from 0, in small steps of the midpoint rule."""
    y, out = 0.0, []
    for f in F:
        total = 0.0
        for _ in range(parts):
            middle = y + 0.5 * (dt / parts) * (f - y) / tau
            y += (dt / parts) * (f - middle) / tau
            total += middle
        out.append(total / parts)
    return np.array(out)


@pytest.mark.parametrize("multiplier", MULTIPLIERS)
def test_what_a_spline_multiplies(multiplier):
    h = history()
    F = C * h.driver * np.abs(h.driver)
    expected = {
        "force": np.ones_like(F),
        "gain": F,
        "even": np.abs(F),
        "step": F - C * h.previous * np.abs(h.previous),
        "rate": np.abs(h.driver) / 8.0,
        "drive": np.ones_like(F),
        "reversed": np.where(
            np.where(F > 0, np.minimum.accumulate(h.driver) < 0, np.maximum.accumulate(h.driver) > 0), F, 0.0
        ),
        "late": lagging(F, 0.5, 2.0) - F,
    }[multiplier]
    term = Flexible("time", "s", (0.0, 5.0, 10.0), (0,), (multiplier,), degree=1, memory=2.0)
    known = term.parameters(SCALE)
    theta = tuple(0.1 * float(p.name.split("_")[-1]) for p in known)
    now = TermContext(RememberedRun(h), SCALE, C, 0.0, h.driver)
    moved = term.apply(F, now, theta) - F
    assert moved == pytest.approx(0.1 * np.minimum(h.middle, 10.0) * expected, rel=1e-5), "constant beyond the knots"
    assert term.apply(F, now, (0.0,) * len(known)) == pytest.approx(F)


@pytest.mark.parametrize(
    "quantity", ["time", "time_since_step", "previous_voltage", "direction", "direction_of_change", "load_history"]
)
def test_coordinates_that_every_run_has(quantity):
    h = history()
    term = Flexible(quantity, "1", (0.5, 2.0), (), ("force",), memory=5.0)
    assert term.over(RememberedRun(h), h.driver, SCALE).shape == h.driver.shape
    assert term.needs == ()
    assert term.trials(SCALE) == term.finer((0.0,), SCALE) == ()


def test_time_since_it_turned_the_other_way_is_seen_on_a_sine():
    """No step, and rests between: what was lost last is counted from the last interval of the other direction."""
    t = np.arange(0.0, 40.0, 0.5)
    V = 8.0 * np.sin(2 * np.pi * t / 20)
    h = history()
    h = replace(h, edges=np.append(t, 40.0), driver=V, thrust=V, count=np.ones(t.size, int), sampled=t, within=0.0 * t)
    since, known = turned(h, V, SCALE)
    assert not known[t < 10.0].any()
    assert known[t > 10.5].all()
    away = known & (np.abs(V) > 0.5)
    assert since[away] == pytest.approx((t[away] + 0.25) % 10.0, abs=0.76)
    term = Flexible("time_since_step", "s", (0.5, 10.0), (1,), ("reversed",))
    assert term.over(RememberedRun(h), V, SCALE) == pytest.approx(since)


def test_a_recorded_quantity_is_needed():
    term = Flexible("water_temperature", "degC", (10.0, 20.0), (0,), ("gain",))
    assert term.needs == ("water_temperature",)
    warm = history(water_temperature=np.full(40, 15.0))
    F = np.ones(40)
    assert term.apply(F, TermContext(RememberedRun(warm), SCALE, C, 0.0, F), (-0.2,)) == pytest.approx(0.9 * F)
    assert Flexible("rotation_rate", "V", (-1.0, 0.0), (1,), ("drive",)).stage == "rotor"


def test_products_of_the_grammar():
    found = monomials_of(["a", "b", "c"])
    assert len(found) == 9 + 9
    assert all(sum(p for _, p in powers) <= 3 for powers in found)


def test_nodes_reach_beyond_common_levels_and_crowd_at_the_ends():
    """Times since a step are common up to the shortest hold only; a limit shows within the last of a sine."""
    since = np.concatenate([np.tile(np.arange(0.01, 0.31, 0.02), 40), np.linspace(0.3, 12.0, 200)])
    assert nodes_of(since)[-1] == pytest.approx(12.0)
    sine = np.sin(np.linspace(0, 60, 20000))
    assert np.count_nonzero(nodes_of(sine) > 0.99) >= 3
