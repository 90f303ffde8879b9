"""What was not named and yet may be there: how much of each effect a run allows, and what that means for the next."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch import policy
from identification.mismatch.answer.against_twin import twin_of
from identification.mismatch.compare.saved_model_baseline import prior_factor
from identification.mismatch.select.family_wise import beside, orthogonal_basis
from identification.mismatch.unnamed.candidates import candidates_of
from identification.physics.dead_band import DeadBand
from identification.physics.motor_lag import MotorLag
from identification.physics.speed_of_advance import SpeedOfAdvance
from identification.physics.zero_offset import ZeroOffset
from tests.identification.diagnosed_runs import dead_band
from tests.identification.mismatch.small import known_noise, short

BAND, LAG = DeadBand(), MotorLag()


def asked(width, terms=(BAND,), seed=0):
    """Data, estimate and what of `terms` a run with a dead band of `width` V allows."""
    recording = short(volts=dead_band(width), seed=seed)
    data, estimate = known_noise({}, [recording])
    return recording, data, estimate, candidates_of(estimate, data, terms)


def test_the_amount_is_what_is_there_within_its_error():
    scores = []
    for seed in range(12):
        _, _, _, found = asked(0.02, seed=seed)
        (term,), (amount,) = found.terms, found.amounts
        std = np.sqrt(found.covariance[0][0])
        there = 0.02 / term.parameters["half_width"]
        scores.append((amount * (1 + 1 / policy.compare.CANDIDATE_SIGMA**2) - there) / std)
    assert abs(np.mean(scores)) < 3 / np.sqrt(12)
    assert 0.4 < np.std(scores) < 1.7


def test_what_looks_alike_shares_what_is_left():
    _, _, _, one = asked(0.02)
    _, _, _, two = asked(0.02, (BAND, LAG))
    assert [t.effect for t in two.terms] in (["dead_band", "motor_lag"], ["motor_lag", "dead_band"])
    band = [t.effect for t in two.terms].index("dead_band")
    assert two.covariance[band][band] >= one.covariance[0][0] * (1 - 1e-9)
    assert np.linalg.eigvalsh(np.array(two.covariance)).min() > 0


def test_neither_what_is_named_nor_what_is_of_its_own_run_is_a_candidate():
    recording = short(volts=dead_band(1.0))
    data, estimate = known_noise({BAND: (1.0,)}, [recording])
    found = candidates_of(estimate, data, (BAND, LAG, ZeroOffset()))
    assert [t.effect for t in found.terms] == ["motor_lag"]
    assert candidates_of(estimate, data, (BAND,)) is None


def test_the_variance_of_a_difference_is_that_of_both_runs():
    recording, data, estimate, found = asked(0.0)
    twin = replace(twin_of(estimate, data, [recording], None), candidates=found)
    _, second, now, _ = asked(0.0, seed=5)
    factor = prior_factor(twin, second, now.fit.theta).thrust[0]
    assert factor.shape == (second.size, 1)
    length = float(np.sqrt(found.covariance[0][0] + found.amounts[0] ** 2))
    whitened = beside(now.weights.whiten([factor / length], []), orthogonal_basis(now.fit.jacobian))
    known = float(np.sum(whitened**2)) * found.covariance[0][0]
    shrunk = 1 / (1 + 1 / policy.compare.CANDIDATE_SIGMA**2)
    assert known == pytest.approx(shrunk, rel=0.2), "of the second run as much is known as of the first"


def test_what_the_second_run_did_not_record_is_left_aside():
    recording, data, estimate, found = asked(0.0)
    flow = replace(found.terms[0], effect="speed_of_advance", form="", parameters={"coefficient": 0.1})
    assert flow.term == SpeedOfAdvance()
    twin = twin_of(estimate, data, [recording], None)
    unseen = replace(twin, candidates=replace(found, terms=(flow,)))
    assert prior_factor(unseen, data, estimate.fit.theta) is None
