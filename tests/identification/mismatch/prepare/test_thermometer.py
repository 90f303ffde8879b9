"""A motor's temperature from noisy samples: by the load, by the rest, and what it began with."""

import numpy as np
import pytest

from identification.mismatch.prepare.channels import followed
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.prepare.scales import scale_of
from identification.mismatch.prepare.thermometer import first_reading, warmth
from identification.recording import Recording
from identification.run_history.remembered import RememberedRun
from tests.identification.diagnosed_runs import TOP, levels, run
from tests.identification.mismatch.prepare.preparing.stepped_recordings import channel

NOISE, BEGUN, TAU = 0.2, 18.0, 60.0
SECONDS = 300.0
EDGES = np.arange(0.0, SECONDS + 0.1, 0.1)
MIDDLE = 0.5 * (EDGES[1:] + EDGES[:-1])


def driven():
    start, level = levels(4, SECONDS, 12.0)
    return level[np.maximum(np.searchsorted(start, MIDDLE, side="right") - 1, 0)]


def heated(volts):
    """K above the water at the ends of the intervals: the recursion of one thermal mass, by hand."""
    rise, out = 0.0, []
    for load in (volts / TOP) ** 4:
        rise += (20.0 * load - rise) * (1 - np.exp(-0.1 / TAU))
        out.append(rise)
    return np.array(out)


def thermometer(value, noise=NOISE, seed=1, every=7):
    t = MIDDLE[::every]
    return channel("motor_temperature", t, value[::every] + noise * np.random.default_rng(seed).standard_normal(t.size))


def test_what_the_load_makes_of_it_is_known_between_the_samples_and_no_kink_is_rounded_off():
    true = BEGUN + heated(driven())
    read = thermometer(true)
    found, error = warmth(read, EDGES, [driven()])
    plain = followed(read, MIDDLE)
    assert np.std(found - true) < 0.04
    assert np.std(plain - true) > 2 * np.std(found - true)
    assert error < 0.4 * NOISE


def test_the_first_is_within_its_error_as_often_as_it_should_be():
    true = BEGUN + heated(driven())
    z = []
    for seed in range(40):
        found, error = warmth(thermometer(true, seed=seed, every=20), EDGES, [driven()])
        z.append((found[0] - true[0]) / error)
    assert np.sqrt(np.mean(np.square(z))) == pytest.approx(1.0, abs=0.35)


def test_what_no_load_makes_is_followed_all_the_same():
    true = BEGUN + heated(driven()) + 3.0 * np.sin(MIDDLE / 20.0)
    found, _ = warmth(thermometer(true), EDGES, [driven()])
    assert np.std(found - true) < 0.12


def test_a_few_samples_are_taken_as_they_are():
    true = BEGUN + heated(driven())
    read = thermometer(true, every=300)
    found, error = warmth(read, EDGES, [driven()])
    assert found == pytest.approx(followed(read, MIDDLE))
    assert error > 0


def test_a_parabola_over_more_samples_is_believed_only_while_it_fits():
    t = np.arange(200.0)
    noise = 0.1 * np.random.default_rng(5).standard_normal(200)
    value, error = first_reading(t, 5.0 + 0.01 * t + noise)
    assert abs(value - 5.0) < 3 * error < 0.15
    value, error = first_reading(t, np.where(t < 20, 5.0, 9.0) + noise)
    assert abs(value - 5.0) < 3 * error


def test_the_runs_begin_and_its_error_are_what_the_scales_refer_to():
    made = run(seconds=120.0)
    t = np.arange(0.0, 120.0, 0.5)
    warm = channel("motor_temperature", t, 18.0 + NOISE * np.random.default_rng(2).standard_normal(t.size))
    h = history_of(Recording("warm", "T1", (*made.channels, warm)))
    scale = scale_of([RememberedRun(h)], 0.5)
    assert scale.cold == pytest.approx(18.0 + 273.15, abs=3 * h.begun_error)
    assert 0 < scale.cold_error == h.begun_error < NOISE
