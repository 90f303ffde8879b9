"""Lines are found with honest standard errors; noise of any colour, however peaked, is none."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.periodic.periodic_disturbances import Line, alias_of_mains, find_lines
from identification.mismatch.periodic.resonances import find_bands
from identification.mismatch.periodic.rotor_angle import turned, turned_by_rate
from identification.mismatch.periodic.spectrum import Series
from identification.recording import Floats
from sim_devices.concealed.draw import NOISE_KINDS, noise_law
from sim_devices.world.noise_law import drawn

RATE, LENGTH = 100.0, 200.0
"""1/s and s of the runs."""


def run(seed: int, kind: str = "white", rate: float = RATE) -> tuple[Series, Floats]:
    """Noise of standard deviation 1 with the turns of a rotor at random levels, and the speed at each sample."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(LENGTH * rate)) / rate + 0.3
    edges = np.concatenate([[0.0], np.cumsum(rng.uniform(2, 8, 100))])
    speed = rng.uniform(-30, 30, 100) * (rng.random(100) < 0.8)
    noise = drawn(noise_law(kind, 1.0, rate, rng), np.zeros(t.size), rate, rng)
    at = speed[np.searchsorted(edges, t, side="right") - 1]
    return Series(t, noise, turned(edges, speed, t)), np.abs(at)


def with_line(series: Series, amplitude: float, angle: Floats) -> Series:
    return Series(series.time, series.residual + amplitude * np.sin(angle), series.turns)


def only(found: tuple[Line, ...]) -> Line:
    assert len(found) == 1
    return found[0]


@pytest.mark.parametrize("kind", NOISE_KINDS)
def test_noise_is_no_line(kind: str) -> None:
    """Longer runs at three rates, 18 of them: none either, at a stated rate of 1 %."""
    for seed in range(3):
        assert find_lines([run(seed, kind)[0]]) == ()


def test_noise_at_half_the_sampling_rate_is_no_line() -> None:
    """Few levels, each held often: some ratio of the rotor shows one of them just there."""
    rng = np.random.default_rng(0)
    levels = np.array([11.2, 14.6, 33.8, 41.6])
    speed = np.concatenate([rng.permutation(np.concatenate([levels, levels])) for _ in range(25)])
    t = np.arange(12000) / 20.0
    series = Series(t, rng.standard_normal(t.size), turned(3.0 * np.arange(speed.size + 1), speed, t))
    assert find_lines([series]) == ()


def test_fixed_line_and_its_standard_errors() -> None:
    z = []
    for seed in range(6):
        series, _ = run(seed)
        line = only(find_lines([with_line(series, 0.2, 2 * np.pi * 13.37 * series.time + 1.0)]))
        assert line.kind == "fixed"
        assert line.phase is not None
        assert line.phase_std is not None
        z.append(
            (
                (line.amplitude - 0.2) / line.amplitude_std,
                (line.frequency - 13.37) / line.frequency_std,
                (line.phase - 1.0) / line.phase_std,
            )
        )
        wave = 0.2 * np.sin(2 * np.pi * 13.37 * series.time + 1.0)
        assert np.std(line.at(series.time) - wave) < 0.05
        assert line.gain > 50
    assert np.max(np.abs(z)) < 4
    assert 0.3 < np.std(z) < 2.5


def test_line_locked_to_the_rotor_beyond_half_the_sampling_rate() -> None:
    series, speed = run(1)
    assert series.turns is not None
    spoilt = with_line(series, 0.0, series.time)
    wave = np.where(speed > 0, 0.4 * np.sin(2 * np.pi * 3 * series.turns + 1.0), 0.0)
    line = only(find_lines([Series(spoilt.time, spoilt.residual + wave, series.turns)]))
    assert line.kind == "rotation"
    assert line.ratio is not None
    assert abs(line.ratio - 3) < 0.01
    assert abs(line.amplitude - 0.4) < 5 * line.amplitude_std
    assert "3 blades" in line.statement
    with pytest.raises(ValueError, match="needs the turns"):
        line.at(series.time)
    left = wave - line.at(series.time, series.turns)
    assert np.std(left[speed > 0]) < 0.15


def test_a_line_whose_angle_slips_at_every_step_keeps_its_amplitude_and_is_found_once() -> None:
    """The turns are summed from a rate with errors: a fifth of a period more or less at each new level."""
    z = []
    for seed in range(4):
        series, speed = run(seed)
        assert series.turns is not None
        rng = np.random.default_rng(seed)
        level = np.cumsum(np.diff(speed, prepend=speed[0]) != 0)
        slip = np.cumsum(rng.normal(0.0, 0.4, level[-1] + 1))[level]
        wave = np.where(speed > 0, 0.4 * np.sin(2 * np.pi * 3 * series.turns + slip), 0.0)
        line = only(find_lines([Series(series.time, series.residual + wave, series.turns)]))
        assert line.kind == "rotation"
        assert line.phase is None
        z.append((line.amplitude - 0.4) / line.amplitude_std)
    assert np.max(np.abs(z)) < 3


def test_a_whole_number_of_periods_per_turn_is_found_fainter_than_any_other() -> None:
    found = {}
    for ratio in (4.0, 4.37):
        hits = 0
        for seed in range(4):
            series, speed = run(seed)
            assert series.turns is not None
            wave = np.where(speed > 0, 0.072 * np.sin(2 * np.pi * ratio * series.turns + 1.0), 0.0)
            hits += len(find_lines([Series(series.time, series.residual + wave, series.turns)]))
        found[ratio] = hits
    assert found[4.0] > found[4.37]


def test_uneven_samples_with_a_gap() -> None:
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(0.1, 0.3, 2000))
    t = t[(t < 120) | (t > 170)]
    r = rng.normal(0, 1, t.size) + 0.5 * np.sin(2 * np.pi * 1.7 * t)
    r[50] = np.nan
    line = only(find_lines([Series(t, r)]))
    assert abs(line.frequency - 1.7) < 5 * line.frequency_std


def test_one_line_in_two_runs() -> None:
    pair = [run(seed)[0] for seed in (5, 6)]
    spoilt = [with_line(s, 0.15, 2 * np.pi * 21.0 * s.time + i) for i, s in enumerate(pair)]
    line = only(find_lines(spoilt))
    assert abs(line.frequency - 21) < 5 * line.frequency_std
    assert {part.run for part in line.parts} == {0, 1}


def test_mains_are_named_also_at_their_alias() -> None:
    series, _ = run(2, rate=46.0)
    line = only(find_lines([with_line(series, 0.4, 2 * np.pi * 50.0 * series.time)]))
    assert abs(line.frequency - 4.0) < 0.01
    assert "mains of 50 Hz would show there" in line.statement
    assert alias_of_mains(50.0, 0.001, 0.02) == 50.0
    assert alias_of_mains(33.3, 0.001, 0.02) is None


def test_short_runs_have_no_lines() -> None:
    series, _ = run(0)
    assert find_lines([Series(series.time[:50], series.residual[:50])]) == ()
    assert find_lines([]) == ()
    assert find_bands([]) == ()


@pytest.mark.parametrize("seed", range(4))
def test_resonant_noise_is_a_band(seed: int) -> None:
    series, _ = run(seed, "resonant")
    rng = np.random.default_rng(seed)
    rng.uniform(2, 8, 100), rng.uniform(-30, 30, 100), rng.random(100)
    peak = noise_law("resonant", 1.0, RATE, rng).peak
    assert peak is not None
    ((f, quality),) = find_bands([series])
    assert abs(f / peak.frequency - 1) < 0.05
    assert 0.5 < quality / (peak.frequency / peak.width) < 2.0


@pytest.mark.parametrize("kind", [k for k in NOISE_KINDS if k != "resonant"])
def test_smooth_noise_has_no_band(kind: str) -> None:
    for seed in range(2):
        assert find_bands([run(seed, kind)[0]]) == ()


def test_turns_of_a_measured_rate() -> None:
    t = np.linspace(0, 10, 101)
    at = np.array([-1.0, 0.05, 5.0, 10.0, 11.0])
    found = turned_by_rate(t, -t, at)
    assert np.allclose(found[1:4], at[1:4] ** 2 / 2)


def test_an_order_that_only_the_line_led_to_is_a_rival_and_never_taken_out_in_its_place():
    """It has no parts to be taken out by: a diagnosis once ended in an exception where it explained more."""
    rng, time = np.random.default_rng(1), np.arange(0.0, 60.0, 0.02)
    turns = np.cumsum(2.0 + 0.01 * (time / 60.0 - 0.5)) * 0.02
    residual = 0.5 * np.cos(2 * np.pi * 3.0 * turns) + 0.3 * rng.standard_normal(time.size)
    line, *_ = find_lines([Series(time, residual, turns)])
    assert line.kind == "fixed"
    assert line.frequency == pytest.approx(6.0, rel=0.005)
    assert line.rival is not None
    assert line.rival.kind == "rotation"
    assert line.rival.gain > line.gain
