"""Offset of two clocks: right within its stated error, with the thruster's lag in it, refused where it is not told."""

import numpy as np
import pytest

from identification.run_history.clock_offset import ClockOffset, Signal, Undetermined, clock_offset

HOLD, STEP = 4.0, 0.02


def staircase(rng, lag=0.0, levels=12):
    """Commands as changes, and the thrust behind a first-order lag (s), in noise that is correlated."""
    volts = rng.uniform(-12, 12, levels)
    volts[[0, -1]] = 0.0
    t = np.arange(0, levels * HOLD, STEP)
    V = volts[(t // HOLD).astype(int)]
    wanted = np.where(V > 0, 0.4, 0.3) * V * np.abs(V)
    thrust, now = np.empty_like(wanted), 0.0
    for k, value in enumerate(wanted):
        now += (value - now) * min(STEP / lag if lag else 1.0, 1.0)
        thrust[k] = now
    return (
        Signal(np.arange(levels) * HOLD, volts, held=True),
        t,
        thrust + np.convolve(rng.normal(0, 0.3, t.size), np.ones(9) / 3, "same"),
    )


def test_the_offset_from_command_steps_to_thrust_is_found_to_a_sample():
    for seed in range(6):
        rng = np.random.default_rng(seed)
        command, t, thrust = staircase(rng)
        offset = rng.uniform(-10, 10)
        found = clock_offset(command, Signal(t + offset, thrust), "thrust")
        assert isinstance(found, ClockOffset)
        assert abs(found.offset - offset) < STEP
        assert found.std < STEP
        assert found.share > 0.9


@pytest.mark.parametrize("phase", [0.01, 0.05, 0.09])
def test_a_command_that_is_logged_changes_between_two_rows(phase):
    """Rows every 0.1 s: the error is that of the phase, which is in the stated standard deviation."""
    command, t, thrust = staircase(np.random.default_rng(2))
    rows = np.arange(phase, t[-1], 0.1)
    found = clock_offset(Signal(rows, command.at(rows), held=True), Signal(t, thrust), "thrust")
    assert abs(found.offset) < 0.07
    assert 0.02 < found.std < 0.06


def test_a_motor_lag_cannot_be_told_from_the_clocks_and_makes_the_offset_longer():
    command, t, thrust = staircase(np.random.default_rng(1), lag=0.3)
    found = clock_offset(command, Signal(t, thrust), "thrust")
    assert 0.05 < found.offset < 0.3


def test_stated_errors_are_those_that_are_made():
    """One signal measured twice, in noise: 30 draws, errors over their stated standard deviation."""
    z = []
    for seed in range(30):
        rng = np.random.default_rng(100 + seed)
        _, t, thrust = staircase(rng, lag=0.15)
        offset = rng.uniform(-10, 10)
        ours = Signal(t, thrust + rng.normal(0, 2, t.size))
        part = slice(300, 2000, 3)
        theirs = Signal(t[part] + offset, 0.1 * thrust[part] + 3 + rng.normal(0, 0.3, t[part].size))
        found = clock_offset(ours, theirs, "same")
        assert isinstance(found, ClockOffset)
        z.append((found.offset - offset) / found.std)
    assert 0.5 < np.std(z) < 1.6


def test_what_fits_alike_at_two_offsets_is_refused():
    t = np.arange(0, 100, 0.1)
    V = 10 * np.sin(2 * np.pi * t / 20)
    found = clock_offset(Signal(t, V, held=True), Signal(t + 3, 0.4 * V * np.abs(V)), "thrust")
    assert isinstance(found, Undetermined)
    assert "fit alike at" in found.reason


@pytest.mark.parametrize("what", ["noise", "constant", "against", "few"])
def test_what_tells_nothing_is_refused_with_the_reason(what):
    rng = np.random.default_rng(3)
    command, t, thrust = staircase(rng)
    response = {
        "noise": Signal(t, rng.normal(size=t.size)),
        "constant": Signal(t, np.ones_like(t)),
        "against": Signal(t, -thrust),
        "few": Signal(t[:20], thrust[:20]),
    }[what]
    says = {"noise": "at no offset", "constant": "never changes", "against": "at no offset", "few": "too few"}[what]
    found = clock_offset(command, response, "thrust")
    assert isinstance(found, Undetermined)
    assert says in found.reason
