"""A line is told by name where it comes again, in other runs or in other parts of the only one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch import policy
from identification.mismatch.answer.periodic_findings import seen_once, told_lines, twin_line, with_lines
from identification.mismatch.periodic.periodic_disturbances import find_lines
from identification.mismatch.periodic.recurrence import Sighting, of_frequency, recurrence
from identification.mismatch.periodic.rotor_angle import turned
from identification.mismatch.periodic.spectrum import Series
from tests.identification.mismatch.answer.answered import draft

RATE, SECONDS, F = 50.0, 60.0, 12.1
IDS = tuple(f"sweep{i}.h5" for i in range(9))


def noise(seed):
    t = np.arange(int(RATE * SECONDS)) / RATE
    return t, np.random.default_rng(seed).standard_normal(t.size)


def sweeps(amplitudes, f=F):
    out = []
    for seed, a in enumerate(amplitudes):
        t, e = noise(seed)
        out.append(Series(t, e + a * np.sin(2 * np.pi * f * t + seed)))
    return out


def only(runs):
    (line,) = find_lines(runs)
    return line


def test_a_line_in_one_of_nine_sweeps_was_seen_once():
    line = only(sweeps([0, 0, 0.876, 0, 0, 0, 0, 0, 0]))
    assert line.p_value < 1e-12
    assert not line.again
    assert (line.seen.clearest.run, line.seen.others) == (2, 8)
    told = with_lines(draft(), (line,), 2.0, None, IDS)
    assert (told.findings, told.mismatch, told.model_terms) == ((), (), ())
    (note,) = told.notes
    assert note.startswith("A line seen once, and no finding: ")
    assert "stands out in sweep2.h5, not in the other 8 runs" in note
    assert told_lines((line,), None) == ()


@pytest.mark.parametrize("amplitudes", [[0.3] * 9, [0.2, 0.2, 0.876, 0.2, 0.2], [0, 0, 0.876, 0, 0.5, 0]])
def test_a_line_in_several_runs_comes_again(amplitudes):
    line = only(sweeps(amplitudes))
    assert line.again
    assert len(with_lines(draft(), (line,), 2.0, None, IDS).findings) == 1


def test_the_mains_may_be_faster_in_another_run():
    a, b = sweeps([0.6, 0.0], 20.0)
    again = Series(b.time, b.residual + 0.6 * np.sin(2 * np.pi * 20.03 * b.time))
    assert of_frequency([(0, a), (1, again)], [1.0, 1.0], 20.0).again
    assert not of_frequency([(0, a), (1, b)], [1.0, 1.0], 20.0).again


@pytest.mark.parametrize(("start", "end", "again"), [(0.0, 60.0, True), (30.5, 44.5, False), (5.0, 40.0, True)])
def test_of_one_run_the_quarters_are_asked(start, end, again):
    t, e = noise(3)
    lasts = (t >= start) & (t < end)
    series = Series(t, e + 0.9 * lasts * np.sin(2 * np.pi * F * t))
    found = of_frequency([(0, series)], [1.0], F)
    assert found.again is again
    if not again:
        once = replace(only(sweeps([0.9])), seen=found)
        (note,) = with_lines(draft(), (once,), 2.0, None, IDS[:1]).notes
        assert "stands out from 30 to 44.98 s, not in the other 3 quarters of the run" in note


def test_a_line_just_clear_enough_is_nearly_always_there_again():
    """Of lines that stand at the threshold of the search nine in ten are told all the same."""
    found = again = 0
    for seed in range(30):
        t, e = noise(100 + seed)
        for line in find_lines([Series(t, e + 0.17 * np.sin(2 * np.pi * F * t))]):
            found, again = found + 1, again + line.again
    assert found > 15
    assert again >= 0.85 * found


def test_noise_alone_seldom_looks_like_a_second_time():
    rng, false = np.random.default_rng(4), 0
    for _ in range(500):
        runs = [(i, Series(np.arange(200) / RATE, rng.standard_normal(200))) for i in range(5)]
        t = runs[0][1].time
        runs[0] = (0, Series(t, runs[0][1].residual + 2 * np.sin(2 * np.pi * F * t)))
        false += of_frequency(runs, [1.0] * 5, F).again
    assert false <= 500 * policy.periodic.COMES_AGAIN_P + 5


def test_what_has_no_second_part_was_seen_once():
    assert not recurrence([Sighting(0, 0.0, 9.0, 1000.0, 2)]).again
    assert recurrence([Sighting(0, 0.0, 9.0, 1000.0, 2), Sighting(1, 0.0, 9.0, 30.0, 2)]).again


def locked(seed, amplitude):
    rng = np.random.default_rng(seed)
    t, e = noise(seed)
    edges = np.arange(0.0, SECONDS + 3, 3.0)
    speed = rng.uniform(4, 12, edges.size - 1)
    turns = turned(edges, speed, t)
    return Series(t, e + amplitude * np.sin(2 * np.pi * 2 * turns + seed), turns)


def test_a_line_of_the_rotor_comes_again_too_or_does_not():
    several = only([locked(seed, 0.8) for seed in range(3)])
    assert several.kind == "rotation"
    assert several.again
    assert only([locked(7, 0.8)]).again
    once = [line for line in find_lines([locked(0, 1.2), locked(1, 0.0), locked(2, 0.0)]) if line.kind == "rotation"]
    assert once
    assert not any(line.again for line in once)


def test_what_a_twin_has_has_come_again():
    line = only(sweeps([0, 0, 0.876, 0]))

    class Before:
        lines = (twin_line(line),)

    assert seen_once(line, None)
    assert not seen_once(line, Before())
