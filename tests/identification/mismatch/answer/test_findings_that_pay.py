"""What does not pay for its parameters is no finding, whoever would tell it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch import policy
from identification.mismatch.answer.against_twin import changed_constant, twin_of
from identification.mismatch.name.naming import name
from identification.mismatch.unnamed.shares import mostly_right
from identification.mismatch.validate.train_test_split import train_test_split
from identification.mismatch.value import Value
from tests.identification.diagnosed_runs import NOISE
from tests.identification.mismatch.answer.answered import BAND, UNEVEN, told
from tests.identification.mismatch.small import known_noise, short


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_term_that_follows_noise_is_neither_told_nor_kept(seed):
    found, _, completed, _ = told(short(seed=seed), {UNEVEN: (0.999,)})
    assert completed.earned == ()
    assert (found.verdict, found.findings, found.model_terms) == ("adequate", (), ())


def test_beside_a_name_that_is_earned_it_goes_alone():
    """In reverse half the thrust; a dead band of a hundredth of a volt pays for nothing."""
    run = short(change=lambda _t, V, F: np.where(V < 0, 0.5, 1.0) * F)
    found, _, completed, _ = told(run, {BAND: (0.01,), UNEVEN: (0.6,)})
    assert [n.term for n in completed.earned] == [UNEVEN]
    assert (found.verdict, found.model_terms) == ("explained", ("asymmetry",))
    assert all(f.bic_gain > 0 for f in found.findings)


def test_no_share_makes_up_for_it():
    data, estimate = known_noise({UNEVEN: (0.999,)}, [short()])
    (named,) = name(estimate, data, [])
    assert named.bic_gain < 0
    assert any("does not pay for its parameters (BIC worse by" in failed for failed in named.failed_checks)
    split = train_test_split(estimate, data, ())
    assert mostly_right(split, [named], 0.0).right == ()


@pytest.mark.parametrize(("sigmas", "told_so"), [(2.0, False), (2.7, False), (3.5, True)])
def test_a_thrust_constant_must_pay_as_well_as_be_rare(sigmas, told_so):
    """2.7 standard errors are rare (p = 0.007), but the square is less than the log of the rows."""
    data, estimate = known_noise({}, [short(seconds=400.0)], NOISE)
    twin = replace(twin_of(estimate, data, [short()], None), covariance=((0.0,),))
    moved = replace(twin, C=twin.C - sigmas * float(estimate.fit.std[0]))
    assert policy.answer.CHANGED_CONSTANT_FALSE_ALARM > 0.007
    assert (changed_constant(moved, estimate, data, "the twin", Value(0.4, 0.0, "N/V^2")) is not None) == told_so
