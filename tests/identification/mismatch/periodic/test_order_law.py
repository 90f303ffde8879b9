"""How a wave of the rotor grows with its speed: told by the speeds, and by a stand that rings."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.mismatch import policy
from identification.mismatch.answer.periodic_findings import line_finding, twin_line
from identification.mismatch.periodic.order_law import FORCE, PICK_UP, OrderLaw, response
from identification.mismatch.periodic.order_search import OrderCandidate, aliases
from identification.mismatch.periodic.order_tracking import find_locked
from identification.mismatch.periodic.periodic_disturbances import find_lines
from identification.mismatch.periodic.rotor_angle import turned, wave_of
from identification.mismatch.periodic.spectrum import Series
from identification.mismatch.periodic.steady_segments import stretches
from identification.run_history.converter import Converter
from identification.run_history.filters import resonant
from tests.identification.mismatch.small import rng

RATE, LENGTH, TOP = 100.0, 150.0, 14.0
ALARM = policy.periodic.LINE_FALSE_ALARM
RING = (1.0, 25.0, 0.1)


def _levels(draw):
    edges = np.concatenate([[0.0], np.cumsum(draw.uniform(2, 6, 90))])
    return edges, draw.uniform(3, TOP, 90)


def turning(seed, size, *, ring=None, noise=1.0):
    """Random levels up to 14 turns/s, three waves a turn of `size(speed)` N at each; a stand that takes them."""
    draw = rng(seed)
    t = np.arange(int(LENGTH * RATE)) / RATE
    edges, speed = _levels(draw)
    turns = turned(edges, speed, t)
    at = speed[np.searchsorted(edges, t, side="right") - 1]
    wave = size(at) * np.sin(2 * np.pi * 3 * turns + 0.7)
    if ring is not None:
        fine = np.arange(20 * t.size) / (20 * RATE)
        at = speed[np.searchsorted(edges, fine, side="right") - 1]
        force = size(at) * np.sin(2 * np.pi * 3 * turned(edges, speed, fine) + 0.7)
        wave = resonant(force, np.full(fine.size, 1 / (20 * RATE)), ring[1], ring[2])[::20]
    return Series(t, noise * draw.standard_normal(t.size) + wave, turns)


def test_imbalance_grows_as_the_square_and_its_size_is_that_at_full_speed():
    off = []
    for seed in range(5):
        found = find_locked([(0, turning(seed, lambda n: 0.6 * (n / TOP) ** 2))], ALARM)
        assert found.law == FORCE
        assert 0.8 * TOP < found.top <= TOP
        off.append((found.amplitude * (TOP / found.top) ** 2 - 0.6) / found.amplitude_std)
        assert found.phase == pytest.approx(0.7, abs=5 * found.phase_std)
    assert np.sqrt(np.mean(np.square(off))) < 2.0


def test_a_pick_up_of_one_size_is_told_as_one():
    for seed in range(4):
        found = find_locked([(0, turning(seed, lambda n: 0.5 + 0 * n))], ALARM)
        assert found.law == PICK_UP
        assert found.amplitude == pytest.approx(0.5, abs=4 * found.amplitude_std)


def test_a_stand_that_rings_makes_some_speeds_louder():
    series = turning(1, lambda n: 0.5 * (n / TOP) ** 2, ring=RING)
    without, with_ring = (find_locked([(0, series)], ALARM, ring=ring) for ring in (None, RING))
    assert with_ring.law == OrderLaw(2, RING)
    assert with_ring.law_gain > without.law_gain + 50
    assert with_ring.amplitude * (TOP / with_ring.top) ** 2 == pytest.approx(0.5, abs=5 * with_ring.amplitude_std)
    made = wave_of(with_ring.parts, 0, series.time, 2 * np.pi * with_ring.ratio * series.turns)
    noise = np.std(series.residual - made)
    assert noise == pytest.approx(1.0, abs=0.05), "what is taken out has the stand in it"


def test_the_response_is_that_of_a_mass_on_a_spring():
    t = np.arange(0.0, 20.0, 1e-4)
    for f in (5.0, 25.0, 60.0):
        out = resonant(np.sin(2 * np.pi * f * t), np.full(t.size, 1e-4), *RING[1:])
        late = t > 10
        found = 2 * np.mean(out[late] * np.exp(-1j * (2 * np.pi * f * (t[late] + 5e-5) - np.pi / 2)))
        assert found == pytest.approx(response(RING, f), abs=0.02 * abs(response(RING, f)))


def test_it_is_said_and_handed_to_a_twin():
    (line,) = find_lines([turning(2, lambda n: 0.8 * (n / TOP) ** 2)])
    assert "as the square of the speed" in line.statement
    values = line_finding(line).parameters
    assert values["growth"].value == 2.0
    assert values["at_speed"].value == pytest.approx(line.top)
    assert twin_line(line).growth == 2.0
    (steady,) = find_lines([turning(2, lambda n: 0.6 + 0 * n)])
    assert "growth" not in line_finding(steady).parameters


def test_an_order_that_samples_show_as_another_is_told_by_the_other_speeds():
    """At 9 turns/s, where nearly all of it is, 20 samples/s show 2.6 waves a turn as 20/9 more or fewer."""
    rng = np.random.default_rng(11)
    t = np.arange(6000) / 20.0
    edges = np.arange(0.0, 303.0, 3.0)
    speed = rng.choice([5.0, 6.2, 7.3, 9.0], edges.size - 1, p=[0.15, 0.15, 0.15, 0.55])
    turns, at = turned(edges, speed, t), speed[np.searchsorted(edges, t, side="right") - 1]
    wave = 0.5 * (at / 9.0) ** 2 * np.sin(2 * np.pi * 2.6 * turns + 1.0)
    series = Series(t, rng.standard_normal(t.size) + wave, turns)
    (line,) = find_lines([series], turns_unit="V s")
    assert line.ratio == pytest.approx(2.6, abs=5 * line.ratio_std)
    seen = {round(abs(2.6 * 9.0 + k * 20.0) / 9.0, 6) for k in range(-5, 6)}
    found = aliases(list(stretches([(0, series)], 9.0)), OrderCandidate(2.6, 0.01, 1e-9), 20.0, 9.0)
    assert {round(each.ratio, 6) for each in found} >= {z for z in seen if 0.2 < z < 12 and abs(z - 2.6) > 0.1}


CONVERTER = Converter(window=0.01, low_pass=0.006)
"""Of a wave of 42 Hz it leaves a half."""


def converted(wave):
    """What the converter shows of `wave`(time): filtered and averaged on a grid twenty times as fine."""
    step = 1 / (20 * RATE)
    fine = np.arange(20 * int(LENGTH * RATE)) * step
    keep = np.exp(-step / CONVERTER.low_pass)
    slow = lfilter([1 - keep], [1, -keep], wave(fine))
    half = round(CONVERTER.window / step / 2)
    total = np.concatenate([[0.0], np.cumsum(slow)])
    middle = np.arange(fine.size)[::20]
    begin, end = np.maximum(middle - half, 0), np.minimum(middle + half, fine.size)
    return (total[end] - total[begin]) / (end - begin)


@pytest.mark.parametrize("frequency", [4.76, 13.37, 40.0])
def test_a_line_is_as_large_as_before_the_device_that_samples_it(frequency):
    noise = turning(3, lambda n: 0 * n)
    shown = converted(lambda t: 0.6 * np.sin(2 * np.pi * frequency * t + 1.0))
    (line,) = find_lines([replace(noise, residual=noise.residual + shown, turns=None, converter=CONVERTER)])
    assert line.amplitude == pytest.approx(0.6, abs=4 * line.amplitude_std)
    assert line.phase == pytest.approx(1.0, abs=5 * line.phase_std + 0.1)
    assert line.shown_amplitude == pytest.approx(0.6 * abs(CONVERTER.response(frequency)), rel=0.15)
    assert np.std(line.at(noise.time) - shown) < 0.05, "what is taken out is what the samples show"


def test_an_order_is_as_large_as_before_the_device_at_every_speed():
    noise = turning(4, lambda n: 0 * n)
    edges, speed = _levels(rng(4))
    at = lambda t: speed[np.searchsorted(edges, t, side="right") - 1]  # noqa: E731
    shown = converted(lambda t: 0.8 * (at(t) / TOP) ** 2 * np.sin(2 * np.pi * 3 * turned(edges, speed, t) + 0.7))
    series = replace(noise, residual=noise.residual + shown, converter=CONVERTER)
    found = find_locked([(0, series)], ALARM)
    assert found.law == FORCE
    assert found.amplitude * (TOP / found.top) ** 2 == pytest.approx(0.8, abs=4 * found.amplitude_std)
    as_shown = find_locked([(0, replace(series, converter=Converter()))], ALARM)
    assert as_shown.amplitude < 0.7 * found.amplitude
    assert as_shown.law_gain < found.law_gain


def test_what_the_device_could_not_show_came_in_behind_it():
    slow = Converter(window=0.05)
    assert abs(slow.response(20.0)) < 0.01
    noise = turning(5, lambda n: 0 * n)
    wave = 0.5 * np.sin(2 * np.pi * 20.0 * noise.time)
    (line,) = find_lines([replace(noise, residual=noise.residual + wave, turns=None, converter=slow)])
    assert line.amplitude == pytest.approx(0.5, abs=4 * line.amplitude_std)
