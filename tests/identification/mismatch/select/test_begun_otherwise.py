"""What the measured rate tells at once is asked of effects too, and what was overtaken is done without; the better
model is kept."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from identification.mismatch.estimate.estimate import fit_without
from identification.mismatch.observer import Interrupted
from identification.mismatch.select import begun_otherwise as module
from identification.mismatch.select.begun_otherwise import NO_EFFECTS, NO_OTHER_BEGINNING, begun_otherwise, overtaken
from identification.mismatch.select.forward_selection import Thruster
from identification.mismatch.select.rounds import Candidate, Round
from identification.mismatch.select.stepwise import accept_threshold
from identification.physics.dead_band import DeadBand
from identification.physics.linear_term import LinearTerm
from identification.physics.load_cell_creep import LoadCellCreep
from identification.physics.rotation_coupling import RotationCoupling
from identification.recording import Channel
from tests.identification.diagnosed_runs import dead_band, levels
from tests.identification.mismatch.small import estimated, rng, selected, short

FOLLOWS, BAND, STRAIGHT = RotationCoupling(), DeadBand(), LinearTerm()
FEW = (FOLLOWS, BAND, STRAIGHT)


def with_rate(slower=None, **how):
    """`slower(t)`: share of the rate that V asks for which is there."""
    start, level = levels(0, 80.0)
    t = np.arange(0.0, 80.0, 1 / 20.0)
    V = level[np.maximum(np.searchsorted(start, t, side="right") - 1, 0)]
    acting = how["volts"](V) if "volts" in how else V * slower(t)
    n = 1.3 * acting + 0.01 * rng(5).standard_normal(t.size)
    return short(extra=(Channel("n", "n", "rotation_rate", "rev/s", t, n),), **how)


def followed(recording):
    """A search that ended with thrust that follows the rate."""
    found = selected({FOLLOWS: (1.0,)}, [recording], FEW)
    data, after = estimated({FOLLOWS: (1.0,)}, [recording])
    _, before = estimated({}, [recording])
    return replace(found, data=data, before=before, after=after)


def ids(found):
    return [term.id for term in found.after.fit.model.terms]


def test_an_effect_that_the_rate_shows_is_told_and_the_rate_is_not():
    found = followed(with_rate(volts=dead_band(1.2)))
    told = begun_otherwise(found, rng(0))
    assert ids(told) == ["dead_band"]
    assert told.terms == FEW, "what may be asked of the rest is what could be before"


def test_a_rate_of_which_no_effect_tells_is_followed():
    late = lambda t: 1.0 - 0.1 * (np.sin(t / 5) > 0)  # noqa: E731
    found = followed(with_rate(slower=late, change=lambda t, _V, F: F * late(t) ** 2))
    assert begun_otherwise(found, rng(0)) is found


class Ended:
    """Somebody has had enough."""

    def stage(self, name): ...

    def trying(self, what):
        raise Interrupted


def test_who_ends_it_keeps_the_model_and_is_told_what_was_not_asked():
    found = followed(with_rate(volts=dead_band(1.2)))
    told = begun_otherwise(found, rng(0), Ended())
    assert told.after is found.after
    assert told.undone == (NO_EFFECTS,)


def test_a_model_that_follows_no_rate_is_as_it_was():
    found = selected({BAND: (1.0,)}, [short(volts=dead_band(1.2))], FEW)
    assert begun_otherwise(found, rng(0)) is found


def bent(_time, volts, force, slope=2.0):
    """`slope`: N/V."""
    return force + slope * np.sign(force) * np.maximum(np.abs(volts) - 1.2, 0.0)


def taken_first(term, gained, recording):
    """A search that took `term` at once, for so much, and then found the dead band."""
    found = selected({term: (0.3,), BAND: (1.0,)}, [recording], FEW)
    first = Round((), None, (Candidate(term, gained, 9.0, False),), None, (term,))
    return replace(found, rounds=(first,))


def test_what_was_overtaken_is_done_without():
    found = taken_first(STRAIGHT, 4000.0, short(volts=dead_band(1.2)))
    assert overtaken(found) == [STRAIGHT]
    told = begun_otherwise(found, rng(0))
    assert ids(told) == ["dead_band"]
    assert told.terms == FEW
    assert told.rounds[0] is found.rounds[0]


def test_what_is_worth_what_it_gained_is_not_asked_again():
    found = taken_first(STRAIGHT, 4000.0, short(volts=dead_band(1.2), change=bent))
    assert overtaken(found) == []
    assert begun_otherwise(found, rng(0)) is found


@pytest.mark.parametrize(
    ("slope", "is_missed", "stays"),
    [(0.6, False, False), (0.6, True, True), (0.9, False, True)],
    ids=["4.6 sigma that no search would find", "4.6 sigma that one finds", "8 sigma"],
)
def test_what_came_first_stays_only_for_what_a_search_would_find(slope, is_missed, stays, monkeypatch):
    monkeypatch.setattr(module, "missed", lambda *_: is_missed)
    found = taken_first(STRAIGHT, 1e9, short(volts=dead_band(1.2), change=partial(bent, slope=slope)))
    assert overtaken(found) == [STRAIGHT]
    worth = fit_without(found.after, STRAIGHT, found.data).chi2 - found.after.fit.chi2
    assert worth > accept_threshold(1), "the model keeps it"
    assert (STRAIGHT.id in ids(begun_otherwise(found, rng(0)))) == stays


def test_what_was_overtaken_and_is_needed_stays():
    found = taken_first(STRAIGHT, 1e9, short(volts=dead_band(1.2), change=bent))
    assert overtaken(found) == [STRAIGHT]
    assert begun_otherwise(found, rng(0)) is found


def test_what_has_values_that_are_not_possible_is_done_without(monkeypatch):
    monkeypatch.setattr(Thruster, "impossible", lambda _self, _estimate, term: term == STRAIGHT)
    found = taken_first(STRAIGHT, 0.0, short(volts=dead_band(1.2)))
    assert overtaken(found) == []
    assert ids(begun_otherwise(found, rng(0))) == ["dead_band"]


def test_who_ends_that_search_is_told_so():
    found = taken_first(STRAIGHT, 4000.0, short(volts=dead_band(1.2)))
    told = begun_otherwise(found, rng(0), Ended())
    assert told.after is found.after
    assert told.undone == (NO_OTHER_BEGINNING,)


WANDERS = LoadCellCreep("two_constants")
SIZES = (0.02, 3.0, 0.02, 30.0)


def test_a_term_of_many_values_beside_which_something_is_left_is_done_without():
    found = selected({WANDERS: SIZES}, [short(volts=dead_band(1.2))], (WANDERS, BAND))
    told = begun_otherwise(found, rng(0))
    assert ids(told) == ["dead_band"]
    assert told.terms == (WANDERS, BAND)


def test_a_term_of_many_values_beside_which_nothing_is_left_is_not_asked_again(monkeypatch):
    found = selected({WANDERS: SIZES, BAND: (1.0,)}, [short(volts=dead_band(1.2))], (WANDERS, BAND))
    monkeypatch.setattr(module, "onwards", None)
    assert begun_otherwise(found, rng(0)) is found
