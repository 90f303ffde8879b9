"""The stage: what stays in the final model, what takes the place of names that were not earned, and their values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.flexible_terms.flexible import Flexible
from identification.mismatch.locate.stage import run as located_by
from identification.mismatch.name.naming import Check
from identification.mismatch.name.stage import run as named_by
from identification.mismatch.unnamed import stage
from identification.mismatch.validate.stage import run as validated_by
from identification.physics.asymmetry import Asymmetry
from identification.physics.dead_band import DeadBand
from identification.physics.zero_offset import ZeroOffset
from tests.identification.diagnosed_runs import dead_band
from tests.identification.mismatch.small import history, rng, selected, short

BAND, UNEVEN, JUMP = DeadBand(), Asymmetry(), ZeroOffset()


def completed(values, recording, unseen=(), unearn=(), chance=(), earn=()):
    """The stages behind a search that ended with this model; names of `unearn` fail a check, those of `chance` are
    worth what noise makes in one search of twenty, and those of `earn` have passed all that they were asked."""
    chosen = selected(values, [recording], list(values))
    located = located_by(chosen, rng(0))
    named = named_by(chosen, located)
    named = tuple(n.asked(Check("own_covariate", "it is one", "it is none")) if n.term in unearn else n for n in named)
    named = tuple(replace(n, p_value=0.05) if n.term in chance else n for n in named)
    named = tuple(replace(n, checks=(), p_value=1e-6) if n.term in earn else n for n in named)
    validated = validated_by(located.estimate, named, chosen.data, unseen)
    return stage.run(chosen, located, validated, unseen, rng(1)), chosen


def test_names_that_are_earned_are_the_whole_answer():
    found, chosen = completed({BAND: (1.0,)}, short(volts=dead_band(1.2)))
    assert not found.open_ended
    assert found.after is chosen.after
    assert [n.term for n in found.earned] == [BAND]
    (interval,) = found.intervals[BAND]
    assert interval.low < found.earned[0].theta[0] < interval.high
    assert (found.unearned, found.flexible) == ((), None)


def test_what_has_no_name_is_modelled_by_a_shape_where_that_predicts():
    found, _ = completed({}, short(change=lambda t, _V, F: F * (1 + 0.06 * np.sin(t / 12))))
    assert found.open_ended
    assert found.flexible.terms[0].quantity == "time"
    assert found.after is found.flexible.estimate
    assert found.flexible.held < 0.9 * found.flexible.without
    assert found.earned == ()


def bumped(_t, V, F):
    """In reverse 0.8 of the forward thrust, and a bump of the static curve."""
    return np.where(F < 0, 0.8, 1.0) * F * np.where(np.abs(V) == 8.0, 1.06, 1.0)


def test_beside_a_rest_a_name_for_no_more_than_noise_makes_is_none():
    uneven = short(change=lambda _t, _V, F: np.where(F < 0, 0.8, 1.0) * F, seconds=160.0)
    alone, _ = completed({UNEVEN: (1.0,)}, uneven, chance=(UNEVEN,))
    assert [n.term for n in alone.earned] == [UNEVEN], "by itself it is believed by its BIC"
    beside, _ = completed({UNEVEN: (1.0,)}, short(change=bumped, seconds=160.0), chance=(UNEVEN,))
    assert beside.open_ended
    assert [n.term for n in beside.earned] == []
    assert "by chance (p 0.05)" in {check.failed for n in beside.unearned for check in n.checks}


def test_a_name_worth_nothing_without_the_terms_that_followed_noise_goes_with_them():
    """ "After a step thrust overshoots by 0 %" was told, beside a lag and a delay that had taken its place."""
    values = {BAND: (1.2,), UNEVEN: (1.0,), JUMP: (0.0, 40.0)}
    found, _ = completed(values, short(volts=dead_band(1.2)), unearn=(JUMP,), earn=(BAND, UNEVEN))
    assert [n.term for n in found.earned] == [BAND]
    assert found.after.fit.model.terms == (BAND,)


def test_a_name_keeps_its_value_beside_a_shape_over_its_own_covariate():
    """With a spline over the command in the model an asymmetry could be any."""
    found, _ = completed({UNEVEN: (1.0,)}, short(change=bumped, seconds=160.0))
    assert "command_voltage" in [t.quantity for t in found.flexible.terms]
    (name,) = found.earned
    assert name.term == UNEVEN
    assert name.theta[0] == pytest.approx(0.8, abs=0.02)
    (interval,) = found.intervals[UNEVEN]
    assert interval.low < name.theta[0] < interval.high
    assert interval.high - interval.low < 0.05


def test_a_term_without_a_name_goes_where_it_only_describes():
    """The zero is back where it was in the last block of time, which judges."""
    knocked = short(change=lambda t, _V, F: F + 1.0 * ((t > 72.0) & (t < 80.0)), seconds=88.0)
    found, chosen = completed({JUMP: (1.0, 72.0)}, knocked, unearn=(JUMP,))
    assert JUMP not in found.after.fit.model.terms
    assert [n.term for n in found.unearned] == [JUMP]
    assert chosen.after.fit.model.terms == (JUMP,)


def test_a_term_without_a_name_stays_where_it_predicts_or_a_shape_takes_its_place():
    found, _ = completed({BAND: (1.0,)}, short(volts=dead_band(1.2)), unearn=(BAND,))
    kept = found.after.fit.model.terms
    assert BAND in kept or any(isinstance(t, Flexible) and t.quantity == "command_voltage" for t in kept)
    assert [n.term for n in found.unearned] == [BAND]
    assert found.open_ended


def test_names_go_where_without_the_others_they_predict_worse_than_the_baseline():
    """Dead band and asymmetry in the run, neither in the one that judges: the jump alone is left, and it helps no
    other run, so that nothing stays."""

    def change(t, _V, F):
        return F + 1.5 * (t > 40.0)

    other = history(replace(short(seed=5, tare=-3.0)))
    found, chosen = completed({BAND: (1.0,), JUMP: (1.0, 40.0)}, short(change=change, volts=dead_band(1.2)), [other])
    assert found.unearned[0].term == BAND
    assert found.after is chosen.before
    assert found.earned == ()
    assert {n.term: n.failed_checks for n in found.unearned}[JUMP] == (stage.ALONE,)
