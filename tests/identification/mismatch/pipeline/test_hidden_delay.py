"""A delay of a part of a tick: ramps in ticks make stairs of it, and a fit may end on the slope of one."""

from __future__ import annotations

import numpy as np

from identification.mismatch.diagnosis import Diagnosis
from identification.mismatch.pipeline import diagnose
from sim_devices import concealed
from tests.concealed.recordings import recording

SEED = [2242789812, 3567668258, 4122946052, 290467523]
"""Of clear/time_skew/3 of the blind proof: a staircase at 161 samples/s whose ramps tick every 19 ms."""


def test_a_delay_does_not_hide_behind_the_one_that_clocks_are_allowed() -> None:
    case = concealed.case(np.random.default_rng(SEED), ["time_skew"], 15.0)
    (truth,) = case.effects
    found = diagnose([recording(case)])
    assert isinstance(found, Diagnosis)
    (finding,) = found.findings
    assert finding.effect == "time_skew"
    low, high = finding.parameters["delay"].interval
    assert low < truth.parameters["delay"] < high


def test_of_the_valleys_that_ticks_make_the_deepest_is_found() -> None:
    """Of a blind proof: a sine in ticks of 41 ms, 27 samples/s, and a delay of two ticks and some."""
    seed = [2985077960, 1464087328, 1631050535, 244341674]
    case = concealed.case(np.random.default_rng(seed), ["time_skew"], 40.0)
    found = diagnose([recording(case)])
    assert isinstance(found, Diagnosis)
    (finding,) = found.findings
    assert finding.effect == "time_skew"
    low, high = finding.parameters["delay"].interval
    assert low < case.effects[0].parameters["delay"] < high
    assert high - low < 0.005
