"""A ramp past a threshold that a twin knows roughly: whether the rotor turned there is no evidence against it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.compare.undecided_rows import decided
from identification.mismatch.pipeline import diagnose
from identification.recording import Channel, Recording
from tests.identification.mismatch.small import history

C, HALF_WIDTH, TICK, SECONDS = 0.5, 1.098, 0.1, 160.0
COARSE = np.array([0.0, 9.0, -0.9, 3.0, 1.1, -9.0, 0.9, -3.0, -1.1, 6.0])


def recording(name, start, volts, seed):
    """With a rate that is read to a thousandth, 20 samples a second."""
    t = np.arange(0.013, start[-1] + (start[1] - start[0]), 0.05)
    V = volts[np.searchsorted(start, t, side="right") - 1]
    n = V * (np.abs(V) > HALF_WIDTH)
    rng = np.random.default_rng(seed)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", start, volts),
        Channel("thrust", "cell", "thrust", "N", t, C * n * np.abs(n) + rng.normal(0, 0.05, t.size)),
        Channel("rotation_rate", "drive", "rotation_rate", "rev/s", t, 1.5 * n + rng.normal(0, 0.001, t.size)),
    )
    return Recording(name, "T1", channels)


@pytest.fixture(scope="module")
def yesterday():
    """Levels of 0.9 and 1.1 V: the threshold is 1.0 V, give or take 0.06."""
    volts = np.tile(COARSE, 8)
    return diagnose([recording("first", 2.0 * np.arange(volts.size), volts, 1)]).twin


@pytest.fixture(scope="module")
def today():
    start = np.arange(0.0, SECONDS, TICK)
    return recording("second", start, 9.0 * np.sin(2 * np.pi * start / SECONDS), 2)


def test_a_ramp_past_it_is_no_news(yesterday, today):
    assert [term.effect for term in yesterday.terms] == ["dead_band"]
    found = diagnose([today], baseline=yesterday)
    assert (found.verdict, found.findings) == ("adequate", ())


def test_rows_on_either_side_of_it_go_and_no_others(yesterday, today):
    whole = history(today)
    (left,) = decided([whole], yesterday)
    std = float(np.sqrt(yesterday.covariance[1][1]))
    gone = np.isfinite(whole.thrust) & ~np.isfinite(left.thrust)
    near = np.abs(np.abs(whole.driver) - yesterday.terms[0].values[0]) < 4.0 * std
    assert 0 < gone.sum() < 0.1 * np.isfinite(whole.thrust).sum()
    assert np.array_equal(gone, near & np.isfinite(whole.thrust))
    assert not np.any(np.isfinite(left.rate) & near)
    assert np.all((left.count == 0) == ~np.isfinite(left.thrust))


def test_levels_that_are_held_there_stay(yesterday):
    volts = np.tile(COARSE, 4)
    whole = history(recording("levels", 2.0 * np.arange(volts.size), volts, 3))
    assert decided([whole], yesterday) == (whole,)
    still = replace(whole, ticks=None)
    assert decided([still], yesterday) == (still,)


def test_a_twin_that_knows_its_threshold_keeps_all(yesterday, today):
    whole = history(today)
    sure = [[c * (i != 1) * (j != 1) for j, c in enumerate(row)] for i, row in enumerate(yesterday.covariance)]
    assert decided([whole], replace(yesterday, covariance=tuple(map(tuple, sure)))) == (whole,)
    assert decided([whole], replace(yesterday, terms=(), names=("C",), covariance=((1.0,),))) == (whole,)


def test_of_two_thresholds_each_has_its_own_error(yesterday, today):
    """The second stands in the covariance as `dead_band#2`."""
    (band,) = yesterday.terms
    far = replace(band, parameters={"half_width": 5.0})
    names = ("C", "dead_band.half_width", "dead_band#2.half_width")
    two = replace(yesterday, terms=(band, far), names=names, covariance=((1e-8, 0, 0), (0, 0, 0), (0, 0, 1e-4)))
    whole = history(today)
    (left,) = decided([whole], two)
    gone = np.isfinite(whole.thrust) & ~np.isfinite(left.thrust)
    assert gone.any()
    assert np.all(np.abs(np.abs(whole.driver[gone]) - 5.0) < 0.04)
