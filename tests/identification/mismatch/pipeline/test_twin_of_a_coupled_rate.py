"""A model in which thrust follows the measured rate, given to another run: C is of the same rate per volt in both."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.compare.simulation import Drive, others_of, simulate
from identification.mismatch.pipeline import diagnose
from identification.recording import Channel
from tests.identification.diagnosed_runs import NOISE, levels, run
from tests.identification.mismatch.pipeline.whole_diagnoses import diagnosed, effects

SECONDS = 120.0


def loaded(seed):
    """V = n/2 + 0.004 n|n|, and a load that nobody recorded slows the rotor by up to a tenth; thrust is 0.1 n|n|."""
    start, level = levels(seed, SECONDS)

    def rate(t):
        V = level[np.maximum(np.searchsorted(start, t, side="right") - 1, 0)]
        free = (np.sqrt(0.25 + 4 * 0.004 * np.abs(V)) - 0.5) / (2 * 0.004)
        return np.sign(V) * free * (1 - 0.05 * (1 + np.sin(2 * np.pi * t / 23 + seed)))

    t = np.arange(0.01, SECONDS - 0.5, 0.05)
    told = rate(t) + 0.02 * np.random.default_rng([seed, 3]).standard_normal(t.size)
    made = run(change=lambda s, _V, _F: 0.1 * rate(s) * np.abs(rate(s)), seed=seed, seconds=SECONDS, noise=0.2 * NOISE)
    rotation = Channel("rotation_rate", "motor", "rotation_rate", "rev/s", t, told)
    return replace(made, channels=(*made.channels, rotation))


@pytest.fixture(scope="module")
def twin():
    found = diagnosed(loaded(0))
    assert "rotation_coupling" in effects(found)
    return found.twin


def test_what_thrust_is_referred_to_is_kept(twin):
    assert twin.slip_rate is not None
    assert twin.rate_per_driver is not None
    assert abs(twin.slip_rate / twin.rate_per_driver - 1) > 0.02, "the winding takes its share of the rate"
    old = replace(twin, slip_rate_per_driver=None)
    assert old.slip_rate == old.rate_per_driver, "a file of before"


def test_another_run_has_the_same_thrust_constant(twin):
    again = diagnose([loaded(1)], baseline=twin)
    assert "thrust_constant" not in effects(again), again.statement
    assert again.model["C"].value == pytest.approx(twin.C, rel=0.01)


def test_what_it_simulates_follows_the_rate_that_was_measured(twin):
    other = loaded(1)
    command, thrust = other.first_of("command_voltage"), other.first_of("thrust")
    drive = Drive(command.time, command.value, others=others_of(other))
    error = thrust.value - simulate(twin, drive, thrust.time).thrust
    assert np.std(error) < 1.2 * 0.2 * NOISE, "of 17 N"
