"""Recordings of the blind proof whose answer was wrong once, each for a reason of its own."""

from __future__ import annotations

import numpy as np

from identification.mismatch.diagnosis import Diagnosis, Finding
from identification.mismatch.pipeline import diagnose
from identification.recording import Channel, Floats
from sim_devices import concealed
from sim_devices.concealed import Case
from tests.concealed.recordings import recording
from tests.identification.diagnosed_runs import levels, run


def turned(seed: int, seconds: float) -> tuple[Floats, Floats]:
    """s and rev/s: two turns for each volt, read ten times a second."""
    start, level = levels(seed, seconds)
    t = np.arange(0.05, seconds, 0.1)
    at = np.maximum(np.searchsorted(start, t, side="right") - 1, 0)
    return t, 2.0 * level[at] + 0.01 * np.random.default_rng(seed).standard_normal(t.size)


def only_finding(case: Case) -> Finding:
    found = diagnose([recording(case)])
    assert isinstance(found, Diagnosis)
    assert found.verdict == "explained"
    (finding,) = found.findings
    return finding


def test_a_lag_is_not_shared_out_to_the_clocks() -> None:
    """Ticks meet the samples at few phases: with the rate read 1 ms early a longer lag fits nearly, and far worse."""
    seed = [3035493884, 1117192900, 2590514184, 3715100004]
    case = concealed.case(np.random.default_rng(seed), ["motor_lag"], 8.0)
    finding = only_finding(case)
    assert finding.effect == "motor_lag"
    found, truth = finding.parameters["time_constant"], case.effects[0].parameters["time_constant"]
    assert abs(found.value - truth) < 3 * found.std  # of this noise it is 2.2
    low, high = found.interval
    assert high - low < 0.1 * truth


def test_a_coupling_smaller_than_the_noise_of_the_rate_is_found_whole() -> None:
    seed = [3837316456, 1178679805, 1368872720, 2039458200]
    case = concealed.case(np.random.default_rng(seed), ["rotation_coupling"], 40.0)
    finding = only_finding(case)
    assert finding.effect == "rotation_coupling"
    low, high = finding.parameters["share"].interval
    assert low < 1.0 < high


def test_a_limit_that_only_the_highest_level_meets_is_named() -> None:
    seed = [1135716813, 3621408974, 1991715632, 2315461773]
    case = concealed.case(np.random.default_rng(seed), ["command_saturation"], 15.0)
    finding = only_finding(case)
    assert finding.effect == "command_saturation"
    low, high = finding.parameters["limit"].interval
    assert low < case.effects[0].parameters["limit"] < high


def test_a_dead_band_that_jumps_is_found_beside_a_rate_that_shows_it() -> None:
    """A jump changes what another does only where they are near: a coarse trial saw a rotation coupling instead."""
    seed = [3874759649, 376861768, 2604729295, 3745126922]
    case = concealed.case(np.random.default_rng(seed), ["dead_band"], 40.0)
    found = diagnose([recording(case)])
    assert isinstance(found, Diagnosis)
    (finding,) = found.findings
    assert finding.effect == "dead_band"
    low, high = finding.parameters["half_width"].interval
    truth = case.effects[0].parameters["half_width"]
    assert low < truth < high
    place = next(m.where for m in found.mismatch if m.where.quantity == "command_voltage")
    assert place.low < -0.9 * truth
    assert 0.9 * truth < place.high < 5 * truth


def test_another_form_of_the_same_physics_gets_steps_enough() -> None:
    seed = [1905205035, 698026874, 738330421, 2921075916]
    finding = only_finding(concealed.case(np.random.default_rng(seed), ["heating"], 40.0))
    assert (finding.effect, finding.form) == ("heating", "magnet")


def test_clocks_that_agree_are_tried_where_a_step_stands_at_the_edge_of_a_sample() -> None:
    seed = [3703502255, 2795828790, 3282270480, 4125542750]
    case = concealed.case(np.random.default_rng(seed), ["load_cell_creep"], 40.0)
    finding = only_finding(case)
    low, high = finding.parameters["time_constant"].interval
    assert low < case.effects[0].parameters["time_constant"] < high


def test_ringing_is_told_below_half_the_sampling_rate() -> None:
    seed = [2259617203, 768869458, 698337856, 953426928]
    case = concealed.case(np.random.default_rng(seed), ["stand_resonance"], 15.0)
    finding = only_finding(case)
    low, high = finding.parameters["frequency"].interval
    assert low < case.effects[0].parameters["frequency"] < high


def test_after_an_exchange_the_search_goes_on() -> None:
    """A jump and a saturation, found first, are one creep; what was saturated besides was never looked for."""
    seed = [4043480491, 1705828569, 877514933, 1778045264]
    case = concealed.case(np.random.default_rng(seed), ["load_cell_creep", "load_cell_saturation"], 20.0)
    found = diagnose([recording(case)])
    assert isinstance(found, Diagnosis)
    assert {f.effect for f in found.findings} == {"load_cell_creep", "load_cell_saturation"}


def test_a_jump_of_the_zero_hides_beside_another_effect() -> None:
    seed = [867076386, 1321258062, 4228449733, 1763088089]
    case = concealed.case(np.random.default_rng(seed), ["zero_offset", "recirculation"], 20.0)
    found = diagnose([recording(case)])
    assert isinstance(found, Diagnosis)
    assert {f.effect for f in found.findings} == {"zero_offset", "recirculation"}


def test_a_cell_on_its_stop_is_named_whose_noise_comes_after() -> None:
    """Where the zero was no load on the cell of the world it was a cavitation."""
    seed = [2688482787, 1804759238, 646837829, 1924247675]
    case = concealed.case(np.random.default_rng(seed), ["load_cell_saturation"], 40.0, forms=["before_noise"])
    finding = only_finding(case)
    assert (finding.effect, finding.form) == ("load_cell_saturation", "before_noise")
    low, high = finding.parameters["limit"].interval
    assert low < case.effects[0].parameters["limit"] < high


def test_conversions_that_clip_before_they_are_averaged_are_one_limit() -> None:
    """A limit met at once and a bent cell stood for it, the limit and C seven and four standard errors off."""
    limit, each, conversions = 70.0, 1.6, 16

    def averaged(_t: Floats, _V: Floats, F: Floats) -> Floats:
        noise = each * np.random.default_rng(5).standard_normal((F.size, conversions))
        return np.clip(F[:, None] + 1.5 + noise, -limit, limit).mean(axis=1) - 1.5

    rate = Channel("rotation_rate", "motor", "rotation_rate", "rev/s", *turned(seed=0, seconds=300.0))
    found = diagnose([run(change=averaged, seconds=300.0, noise=0.01, extra=(rate,))])
    assert isinstance(found, Diagnosis)
    (finding,) = found.findings
    assert (finding.effect, finding.form, found.verdict) == ("load_cell_saturation", "averaged", "explained")
    for name, truth in (("limit", limit), ("noise", each)):
        low, high = finding.parameters[name].interval
        assert low < truth < high
