"""How far the rotor is from what the command makes of it, read while a ramp goes on in ticks."""

from dataclasses import replace

import numpy as np
import pytest

from identification.recording import Channel, Recording
from identification.run_history.rate_gap import driver_at_rate, gap_of_driver, has_own_way, held_rows
from identification.run_history.remembered import RememberedRun
from identification.run_history.slip import slip
from tests.identification.mismatch.small import history

TICK, K, SECONDS = 0.02, 0.73, 160.0


def ramped(share=0.012, period=20.0, step=0.8):
    """Levels of 4 s, half a second of ramp in ticks of `step` V between them; the rate is off by a share that comes and
    goes, and read at instants that are not quite the ticks'."""
    rng = np.random.default_rng(3)
    time = TICK * np.arange(int(SECONDS / TICK))
    aims = rng.choice([-20.0, -12.0, -5.0, 5.0, 12.0, 20.0], int(SECONDS / 4.0) + 1)
    volts, now = [], 0.0
    for t in time.tolist():
        aim = aims[int(t / 4.0)]
        now += float(np.clip(aim - now, -step, step))
        volts.append(now)
    level = np.array(volts)
    read = time + rng.uniform(0.0, TICK, time.size)
    own = 1.0 + share * np.sin(2 * np.pi * read / period)
    rate = K * own * level + 0.002 * rng.standard_normal(time.size)
    cell = np.arange(0.0, SECONDS, 1 / 90)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", time, level),
        Channel("thrust", "cell", "thrust", "N", cell, np.interp(cell, time, level * np.abs(level))),
        Channel("rotation_rate", "motor", "rotation_rate", "rev/s", read - 0.6 * TICK, rate),
    )
    return Recording("ramped", "T1", channels, source="ramped.h5")


def test_rows_between_which_the_driver_moves_by_more_than_the_noise_are_not_held():
    driver = np.concatenate([np.full(40, 3.0), np.arange(3.0, 9.0), np.full(40, 9.0)])
    gap = 0.01 * np.random.default_rng(0).standard_normal(driver.size)
    held = held_rows(driver, gap)
    assert held[:39].all()
    assert held[48:].all()
    assert not held[41:45].any()


def test_all_rows_are_asked_where_the_driver_never_rests():
    driver = np.linspace(0.0, 50.0, 100)
    assert held_rows(driver, 0.01 * np.random.default_rng(0).standard_normal(100)).all()


@pytest.mark.filterwarnings("error")
def test_too_few_rows_to_know_their_noise_are_all_asked():
    assert held_rows(np.array([0.0, 5.0]), np.array([0.1, 0.2])).all()


def test_a_ramp_says_when_the_rate_was_read_and_not_how_far_off_it_is():
    run = RememberedRun(h := replace(history(ramped()), rate_per_driver=K))
    found = slip(run, h.driver, K)
    true = 0.012 * h.driver * np.sin(2 * np.pi * h.middle / 20.0)
    assert np.std(found - true) < 0.6 * np.std(true), "2.3 times it where every row is asked"


def test_holds_are_asked_also_where_most_of_a_run_is_ramps():
    run = RememberedRun(h := replace(history(ramped(step=0.2)), rate_per_driver=K))
    held = held_rows(driver_at_rate(h), gap_of_driver(h))
    assert 0.3 < np.mean(held) < 0.5
    true = 0.012 * h.driver * np.sin(2 * np.pi * h.middle / 20.0)
    left = np.std(slip(run, h.driver, K) - true)
    assert left < 0.08 * np.std(true), "as large as it where every row is asked, or the curve found before what wanders"


def test_what_goes_on_from_a_ramp_into_the_hold_is_the_rotors_own_way():
    """The loop of a drive holds the speed, and overshoots. A clock that is off, and jitter, end with the ramp."""
    rng = np.random.default_rng(5)
    time = 0.02 * np.arange(4000)
    held = np.mod(time, 2.0) > 0.8
    driver = np.interp(np.mod(time, 8.0), [0.0, 0.8, 2.0, 2.8, 4.0, 4.8, 6.0, 6.8], [-9.0, 3, 3, 9, 9, -3, -3, -9])
    noise = 0.02 * rng.standard_normal(time.size)
    swing = np.sin(2 * np.pi * np.mod(time, 2.0) / 1.1) * np.exp(-np.mod(time, 2.0) / 4.0)
    assert has_own_way(driver, swing + noise, held)
    assert not has_own_way(driver, np.where(held, 0.0, swing) + noise, held)
    assert not has_own_way(driver, swing * rng.uniform(-1.0, 1.0, time.size), held)
