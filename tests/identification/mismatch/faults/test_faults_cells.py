"""Cells of a run and the figures taken over them, beside means, regressions and jackknife written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest
from scipy.stats import t as student

from identification.mismatch.faults.cells import (
    BLOCKS,
    MOST_CELLS,
    Cells,
    by_blocks,
    cells_of,
    explained,
    fitted,
    gain,
    own,
    shapes,
)
from identification.recording import Channel, Recording
from tests.identification.mismatch.small import rng, short


def channel(quantity, unit, time, value, **more):
    return Channel(quantity, quantity, quantity, unit, time, value, **more)


def cells(driver, **values):
    """Cells made by hand: 0.1 s each, a driver in -1..1."""
    time = 0.1 * np.arange(driver.size)
    return Cells(Recording("r", "T", ()), "command_voltage", time, driver, 10.0, values)


# ---------------------------------------------------------------- from a recording


def test_each_sample_is_a_cell_where_they_are_few():
    run = short()
    found = cells_of(run)
    thrust = run.first_of("thrust")
    after = thrust.time >= run.channels[0].time[0]
    assert found.time == pytest.approx(thrust.time[after], abs=1e-9)
    assert found.values["thrust"] == pytest.approx(thrust.value[after])
    assert found.size == pytest.approx(12.0)
    assert np.max(np.abs(found.driver)) == 1.0


def test_a_long_run_has_means_over_cells():
    run = short(rate=100.0)
    found = cells_of(run)
    thrust = run.first_of("thrust")
    assert found.time.size == MOST_CELLS
    edges = np.append(found.time - 0.5 * np.diff(found.time)[0], found.time[-1] + 0.5 * np.diff(found.time)[0])
    for k in (3, 700, 1400):
        inside = (thrust.time >= edges[k]) & (thrust.time < edges[k + 1])
        assert found.values["thrust"][k] == pytest.approx(thrust.value[inside].mean())


def test_a_slow_channel_is_interpolated_and_a_stretch_left_out():
    run = short()
    t = np.arange(0.0, 80.0, 5.0)
    slow = channel("water_temperature", "degC", t, 10 + 0.1 * t)
    found = cells_of(replace(run, channels=(*run.channels, slow)), {"water_temperature": (20.0, 40.0)})
    seen = found.values["water_temperature"]
    inside = (found.time >= 20.0) & (found.time < 40.0)
    assert np.all(np.isnan(seen[inside]))
    known = np.isfinite(seen)
    assert seen[known] == pytest.approx(10 + 0.1 * found.time[known], abs=1e-9)


def test_without_a_driver_or_samples_there_are_none():
    run = short()
    command, thrust = run.channels
    assert cells_of(replace(run, channels=(thrust,))) is None
    still = replace(command, value=np.full(command.value.size, 4.0))
    assert cells_of(replace(run, channels=(still, thrust))) is None
    few = replace(thrust, time=thrust.time[:5], value=thrust.value[:5])
    assert (
        cells_of(replace(run, channels=(replace(command, time=command.time[:3], value=command.value[:3]), few))) is None
    )


def test_the_own_channel_of_several_is_the_primary_one():
    t = np.arange(3.0)
    other = channel("thrust", "N", t, t, thruster="T2")
    first = channel("thrust", "N", t, t)
    primary = channel("thrust", "N", t, t, thruster="T1", calibration={"role": "primary"})
    assert own(Recording("r", "T1", (other, first, primary)), "thrust") is primary
    assert own(Recording("r", "T1", (other, first)), "thrust") is first
    assert own(Recording("r", "T1", (other,)), "thrust") is None


def test_both_ways_takes_a_share_of_either_side():
    x = np.concatenate([np.full(90, 0.8), np.full(10, -0.8)])
    assert cells(x).both_ways
    assert not cells(np.abs(x)).both_ways
    assert not cells(np.where(np.arange(100) < 99, 0.8, -0.8)).both_ways


# ---------------------------------------------------------------- figures


def driven(seed=0, n=320):
    return np.repeat(rng(seed).uniform(-1, 1, n // 8), 8)


def test_share_explained_is_r_squared():
    x = driven()
    y = 3 * x + 0.5 * rng(1).standard_normal(x.size)
    y[::7] = np.nan
    good = np.isfinite(y)
    assert explained(shapes(x)["linear"], y) == pytest.approx(np.corrcoef(x[good], y[good])[0, 1] ** 2)
    assert explained(shapes(x)["linear"], np.full(x.size, np.nan)) == 0.0
    assert explained(shapes(x)["linear"], np.ones(x.size)) == 0.0


@pytest.mark.parametrize(
    ("name", "law"),
    [
        ("linear", lambda x: 2 - 3 * x),
        ("quadratic", lambda x: 1 + 4 * x * np.abs(x)),
        ("odd", lambda x: x - 2 * x * np.abs(x) + x**3),
        ("even", lambda x: 1 + 2 * np.abs(x) - x**2),
        ("sides", lambda x: np.where(x > 0, 2, 5) * x * np.abs(x)),
        ("linear_sides", lambda x: np.where(x > 0, 2, -1) * x),
    ],
)
def test_each_shape_carries_its_law_and_no_other(name, law):
    x = driven()
    known = shapes(x)
    assert explained(known[name], law(x)) == pytest.approx(1.0)
    if name == "even":
        assert explained(known["linear"], law(x)) < 0.3
    _, left = fitted(known[name], law(x))
    assert left == pytest.approx(0.0, abs=1e-9)


def test_a_gain_is_the_regression_with_a_jackknife_over_blocks():
    x = driven(3)
    y = 3 * x * np.abs(x) + 0.3 * rng(4).standard_normal(x.size)
    here = cells(x)
    slope, error, p = gain(here, shapes(x)["quadratic"], y, 1)
    X = np.column_stack([np.ones(x.size), x * np.abs(x)])
    assert slope == pytest.approx(np.linalg.lstsq(X, y, rcond=None)[0][1])
    block = np.arange(x.size) * BLOCKS // x.size
    left = [np.linalg.lstsq(X[block != b], y[block != b], rcond=None)[0][1] for b in range(BLOCKS)]
    assert error == pytest.approx(np.sqrt((BLOCKS - 1) * np.mean((left - np.mean(left)) ** 2)))
    assert p == pytest.approx(2 * student.sf(slope / error, BLOCKS - 1), rel=1e-6)


def test_p_values_over_blocks_are_even_where_nothing_is_even_under_correlated_noise():
    """AR(1) noise of 0.7: a test over samples would find something in a third of the draws."""
    found = []
    for seed in range(200):
        e = rng(seed).standard_normal(640)
        for i in range(1, e.size):
            e[i] = 0.7 * e[i - 1] + e[i]
        found.append(by_blocks(cells(np.linspace(-1, 1, 640)), e)[2])
    assert kstest(found, "uniform").pvalue > 0.01


def test_what_is_above_zero_in_every_block_is_seen_and_too_few_blocks_say_nothing():
    mean, error, p = by_blocks(cells(driven()), 0.4 + 0.1 * rng(2).standard_normal(320))
    assert mean == pytest.approx(0.4, abs=0.03)
    assert error < 0.02
    assert p < 1e-9
    lonely = np.full(320, np.nan)
    lonely[:10] = 1.0
    assert by_blocks(cells(driven()), lonely) == (1.0, np.inf, 1.0)
    assert by_blocks(cells(driven()), np.ones(320))[1:] == (0.0, 0.0)
