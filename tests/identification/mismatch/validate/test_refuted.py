"""Terms without a name leave the model where what was not fitted is predicted better without them, or where the
measured rate contradicts them."""

from __future__ import annotations

from identification.mismatch.name.named_term import Check
from identification.mismatch.name.naming import name
from identification.mismatch.validate.refuted import refuted, without_refuted
from identification.mismatch.validate.train_test_split import refitted_without, train_test_split
from identification.physics.dead_band import DeadBand
from identification.physics.zero_offset import ZeroOffset
from tests.identification.diagnosed_runs import dead_band
from tests.identification.mismatch.small import known_noise, short

BAND, JUMP = DeadBand(), ZeroOffset()


def knocked():
    """A dead band, and a zero that is back where it was in the last block of time, which judges: a jump that stays
    describes the block before and predicts that one worse."""
    made = short(
        change=lambda t, _V, F: F + 1.0 * ((t > 72.0) & (t < 80.0)),
        volts=dead_band(1.2),
        seconds=88.0,
    )
    data, estimate = known_noise({BAND: (1.2,), JUMP: (1.0, 72.0)}, [made])
    return data, estimate, train_test_split(estimate, data, ()), name(estimate, data, [])


def test_what_only_describes_goes_and_what_predicts_stays():
    data, estimate, split, named = knocked()
    gone = refuted(split, named, same_run=True)
    assert [n.term for n in gone] == [JUMP]
    less, again = without_refuted(estimate, gone, data, ())
    assert less.fit.model.terms == again.estimate.fit.model.terms == (BAND,)
    assert again.judge(again.estimate.fit).rmse < split.judge(split.estimate.fit).rmse
    assert refuted(again, [n for n in named if n not in gone], same_run=True) == ()


def test_another_run_need_not_repeat_what_is_of_one_runs_own_time():
    _, _, split, named = knocked()
    assert refuted(split, named, same_run=False) == ()


def test_what_the_measured_rate_contradicts_goes_whatever_it_predicts():
    """Beside a coupling whose share came out a percent too large a winding took C 13 % off the truth, and predicted
    blocks of time as well as what it bent."""
    _, _, split, named = knocked()
    off = Check("rate_levels", "the measured rate stands where it puts it", "its levels are missed")
    doubted = [n.asked(off) if n.term == BAND else n for n in named]
    assert split.judge(split.estimate.fit).rmse < split.judge(refitted_without(split, BAND)).rmse
    assert [n.term for n in refuted(split, doubted, same_run=False)] == [BAND]
