"""The search with a few terms of the catalogue: what it adds, drops, exchanges, and does not try twice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.estimate.estimate import fit_without
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.select.exchange.likeness import mirrored
from identification.mismatch.select.exchange.rivals import swaps
from identification.mismatch.select.forward_selection import Thruster, prune, resumed
from identification.mismatch.select.stage import exchange_rivals
from identification.mismatch.select.stepwise import accept_threshold, exchanged
from identification.physics.asymmetry import Asymmetry
from identification.physics.command_saturation import CommandSaturation
from identification.physics.dead_band import DeadBand
from identification.physics.exponent import Exponent
from identification.physics.linear_term import LinearTerm
from identification.physics.load_cell_saturation import LoadCellSaturation
from identification.physics.motor_lag import MotorLag
from identification.physics.torque_crosstalk import TorqueCrosstalk
from identification.physics.zero_drift import ZeroDrift
from identification.physics.zero_offset import ZeroOffset
from tests.identification.diagnosed_runs import dead_band
from tests.identification.mismatch.small import data_of, estimated, known_noise, placed, rng, selected, short

BAND, STRAIGHT, POWER, UNEVEN, JUMP, DRIFT = (
    DeadBand(),
    LinearTerm(),
    Exponent(),
    Asymmetry(),
    ZeroOffset(),
    ZeroDrift(),
)
FEW = (BAND, STRAIGHT, POWER, UNEVEN, JUMP)


def banded(change=None, **how):
    return short(change=change, volts=dead_band(1.2), **how)


def ids(estimate):
    return [t.id for t in estimate.fit.model.terms]


def searched(recording, terms=FEW):
    """(begun, ended) from the bare model on, with the noise estimated as it goes."""
    data, bare = estimated({}, [recording])
    begun = replace(selected({}, [recording], terms), data=data, before=bare, after=bare)
    return begun, resumed(begun, bare, rng(0))


# ---------------------------------------------------------------- forwards


def test_what_is_there_is_added_one_term_after_the_other():
    _, found = searched(banded(change=lambda t, _V, F: F + 2.0 * (t > 40)))
    assert ids(found.after) == ["dead_band", "zero_offset"]
    assert found.after.fit.values[BAND][0] == pytest.approx(1.2, abs=0.03)
    assert found.after.fit.values[JUMP] == pytest.approx((2.0, 40.0), abs=0.3)
    assert len(found.rounds) == 3, "one before each term, and the last that found nothing"
    assert found.last is found.rounds[-1].screening
    assert found.last.largest < max(found.last.threshold, 4.5)


def test_where_nothing_is_nothing_is_added():
    for seed in range(3):
        begun, found = searched(short(seed=seed))
        assert found.after is begun.after


def test_a_model_that_is_known_gives_way_to_the_next_best():
    """Where the dead band was tried before and did not last, the line or the power that resembles it is taken."""
    begun, _ = searched(banded())
    data, known = estimated({BAND: (1.0,)}, [banded()])
    found = resumed(replace(begun, data=data, after=known), begun.after, rng(0))
    assert set(found.after.fit.model.terms) not in (set(), {BAND})
    assert found.after.fit.deviance < begun.after.fit.deviance - 100


def test_a_drift_that_the_noise_took_for_its_own_is_found_by_estimating_both():
    """No screening against that noise sees it: what is left is below the threshold."""
    drifting = short(change=lambda t, _V, F: F + 0.003 * t, seconds=160.0)
    begun, found = searched(drifting, (DRIFT, JUMP))
    assert sum(begun.after.noise.slow) > 0.01, "a noise as slow as the drift"
    first = found.rounds[0].screening
    assert first.largest < first.threshold
    assert ids(found.after) == ["zero_drift"]
    assert sum(found.after.noise.slow) < 0.1 * sum(begun.after.noise.slow)


# ---------------------------------------------------------------- backwards


def test_terms_that_do_not_earn_their_place_are_dropped():
    data, estimate = estimated({BAND: (1.0,), UNEVEN: (1.0,), JUMP: (0.01, 30.0)}, [banded()])
    kept = prune(estimate, data)
    assert kept.fit.model.terms == (BAND,)
    loss = fit_without(kept, BAND, data).chi2 - kept.fit.chi2
    assert loss > accept_threshold(1)


def test_terms_that_do_are_kept_as_they_are():
    recording = banded(change=lambda t, _V, F: F + 2.0 * (t > 40))
    data, estimate = estimated({BAND: (1.0,), JUMP: (1.0, 40.0)}, [recording])
    assert prune(estimate, data) is estimate
    data, bare = estimated({}, [recording])
    assert prune(bare, data) is bare


# ---------------------------------------------------------------- rivals


def test_a_rival_is_refitted_in_the_place_of_the_term():
    """Its loss is the difference in BIC of two fits made apart."""
    data, estimate = known_noise({BAND: (1.0,)}, [banded()])
    less = fit_without(estimate, BAND, data)
    found = swaps(estimate, BAND, less, data, FEW)
    best = {r.term: r for r in found}
    assert [r.bic_loss for r in found] == sorted(r.bic_loss for r in found)
    assert BAND not in best
    for term, begin in ((STRAIGHT, (-0.5,)), (POWER, (2.3,))):
        if term in best:
            model, theta = placed({term: begin}, estimate.fit.theta)
            alone = fit(model, theta, data, estimate.weights)
            assert best[term].fit.chi2 == pytest.approx(alone.chi2, rel=0.02)
            assert best[term].bic_loss == pytest.approx(alone.chi2 - estimate.fit.chi2, rel=0.05)
    assert all(r.bic_loss > 20 for r in found), "nothing does as well as the truth"


def test_the_wrong_one_of_two_is_exchanged_for_the_right():
    found = selected({STRAIGHT: (-0.5,)}, [banded()], FEW)
    after = exchange_rivals(found, rng(0))
    assert ids(after.after) == ["dead_band"]
    assert after.after.fit.chi2 < found.after.fit.chi2 - 100


def test_the_right_one_stays_and_how_it_stands_is_known():
    found = selected({BAND: (1.0,)}, [banded()], FEW)
    after = exchange_rivals(found, rng(0))
    assert after.after is found.after
    less, rivals = after.standing[BAND]
    assert less.model.terms == ()
    assert all(r.bic_loss > 0 for r in rivals)
    bare = selected({}, [short()], FEW)
    assert exchange_rivals(bare, rng(0)) is bare


def test_what_was_beside_a_wrong_term_goes_with_it():
    """A line and a power repaired each other: the dead band alone does better than both."""
    found = selected({STRAIGHT: (-0.5,), POWER: (2.2,)}, [banded()], FEW)
    after = exchange_rivals(found, rng(0))
    assert ids(after.after) == ["dead_band"]


def test_two_that_are_the_same_curve_stay_as_they_were():
    """An asymmetry and what a torque does to the cell: neither is better."""
    recording = short(change=lambda _t, V, F: np.where(V < 0, 0.9, 1.0) * F)
    data, estimate = known_noise({UNEVEN: (1.0,)}, [recording])
    after, standing = exchanged(Thruster(data, (UNEVEN, TorqueCrosstalk())), estimate)
    assert after is estimate
    (rival,) = standing[UNEVEN][1]
    assert abs(rival.bic_loss) < 1.0


def test_a_limit_where_the_noise_goes_on_is_no_rival_of_a_drive_that_saturates():
    """The drive stops at 10 V, the readings go on scattering there: no cell clips."""
    drive, cell = CommandSaturation("hard"), LoadCellSaturation("hard")
    recording = short(volts=lambda V: np.clip(V, -10.0, 10.0), rate=20.0, tare=0.0)
    data, _ = data_of([recording])
    values = {drive: drive.trials(data.scale)[0]}
    data, estimate = known_noise(values, [recording])
    assert estimate.fit.values[drive][0] == pytest.approx(10.0, abs=0.1)
    less = fit_without(estimate, drive, data)
    assert all(r.term != cell for r in swaps(estimate, drive, less, data, (drive, cell)))


def test_an_amount_on_the_other_side_of_nothing():
    data, _ = data_of([short()])
    assert mirrored(UNEVEN, (0.9,), data) == (pytest.approx(1.1),)
    assert mirrored(JUMP, (2.0, 30.0), data) == (-2.0, 30.0)
    assert mirrored(BAND, (1.0,), data) == (0.0,), "no negative dead band"
    lag = MotorLag("first_order")
    assert mirrored(lag, (0.1,), data)[0] == lag.parameters(data.scale)[0].low
