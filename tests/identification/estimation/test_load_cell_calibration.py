"""Promise 34: cells of known gain, zero, hysteresis and noise, calibrated with known forces up and down."""

import numpy as np
import pytest

from identification.estimation.load_cell_calibration import WRONG, calibrate

RUNS = 500
UP = np.arange(0.0, 101.0, 10.0)
FORCE = np.concatenate([UP, UP[-2::-1]])
"""N"""


def readings(rng, gain, zero, lag, noise, force=FORCE):
    """A cell whose lag depends on where it comes from; not the estimator's own formula: a loop of a sine."""
    share = force / 100.0
    way = np.sign(np.diff(force, prepend=-1.0))
    return zero + gain * force - lag * way * np.sin(np.pi * share) + noise * rng.standard_normal(force.size)


def cells(seed):
    """(rng, gain, zero, lag, noise) of sound cells, in counts."""
    for child in np.random.default_rng(seed).spawn(RUNS):
        gain, noise = child.uniform(50.0, 5000.0), child.uniform(0.01, 0.2)
        yield child, gain, child.uniform(-1e5, 1e5), gain * child.uniform(0.0, 0.3), gain * noise


def test_the_gain_is_within_its_interval(report):
    found = [(gain, calibrate(FORCE, readings(rng, gain, *rest))) for rng, gain, *rest in cells(34)]
    held = sum(each.low <= gain <= each.high for gain, each in found)
    flagged = sum(each.wrong is not None for _, each in found)
    report("gain within its own 95 % interval", 100 * held / RUNS, f"% of {RUNS} runs")
    report("sound calibrations called wrong", 100 * flagged / RUNS, "%")
    assert 0.93 * RUNS <= held <= 0.985 * RUNS, "no wider than it need be either"
    assert flagged <= 3 * WRONG * RUNS


def test_uncertain_weights_are_in_the_interval(report):
    """A set of weights that is off by its own uncertainty, all of them together."""
    held = 0
    for rng, gain, zero, lag, noise in cells(35):
        off = 1.0 + 2e-3 * rng.standard_normal()
        found = calibrate(FORCE, readings(rng, gain, zero, lag, 0.1 * noise, FORCE * off), 2e-3)
        held += found.low <= gain <= found.high
    report("the same with weights of 0.2 %", 100 * held / RUNS, f"% of {RUNS} runs")
    assert held >= 0.93 * RUNS


def test_a_wrong_weight_is_named_with_its_step(report):
    """2 kg in the place of 1 kg, at any step; noise of a hundredth of that."""
    named = 0
    for rng, gain, zero, lag, _ in cells(36):
        step = int(rng.integers(FORCE.size))
        reading = readings(rng, gain, zero, lag, gain * 0.1)
        entered = FORCE.copy()
        entered[step] += 9.80665
        found = calibrate(entered, reading).wrong
        named += found is not None and found.step == step and abs(found.expected - FORCE[step]) < 1.5
    report("wrong weights named", 100 * named / RUNS, f"% of {RUNS} runs")
    assert named >= 0.95 * RUNS


def test_hysteresis_is_told():
    rng = np.random.default_rng(1)
    found = calibrate(FORCE, readings(rng, 100.0, 5.0, 40.0, 1.0))
    assert found.hysteresis == pytest.approx(-80.0, rel=0.05)
    assert (found.scale, found.offset) == pytest.approx((0.01, -0.05), abs=0.03)
    once = calibrate(UP, readings(rng, 100.0, 5.0, 0.0, 1.0, UP))
    assert (once.hysteresis, once.hysteresis_std) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("force", "reading", "said"),
    [
        (np.ones(9), np.arange(9.0), "all forces are the same"),
        (UP[:3], UP[:3], "too few"),
        (UP, np.full(UP.size, np.nan), "finite"),
        (UP, np.zeros(UP.size), "does not change with the force"),
    ],
)
def test_what_tells_no_gain(force, reading, said):
    with pytest.raises(ValueError, match=said):
        calibrate(force, reading)
