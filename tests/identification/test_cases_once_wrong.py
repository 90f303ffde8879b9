"""Recordings of the blind proof whose answer was wrong once, each for a reason of its own."""

from __future__ import annotations

import numpy as np

from identification.mismatch.diagnosing import diagnose
from identification.mismatch.diagnosis import Diagnosis, Finding
from sim_devices import concealed
from sim_devices.concealed import Case
from tests.concealed.recordings import recording


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
    low, high = finding.parameters["time_constant"].interval
    truth = case.effects[0].parameters["time_constant"]
    assert low < truth < high
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
