"""Stepwise selection of columns of a linear model: a `System` of a few lines, whose answers are worked out by hand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from identification.mismatch import policy
from identification.mismatch.name.named_term import Check, named_term, restated
from identification.mismatch.select.rounds import Candidate, Unhidden
from identification.mismatch.select.stepwise import (
    RivalTerm,
    accept_threshold,
    asked_again,
    exchanged,
    forward,
    pruned,
)

ROWS = 64
LOGN = float(np.log(ROWS))


@dataclass(frozen=True)
class Column:
    id: str
    form: str = ""

    def parameters(self, scale):
        return ()

    def statement(self, theta, scale):
        return f"{self.id} {theta[0]:.2g}"


@dataclass(frozen=True, eq=False)
class Layout:
    terms: tuple[Column, ...]

    def of(self, term):
        at = self.terms.index(term)
        return slice(at, at + 1)


@dataclass(frozen=True, eq=False)
class Fit:
    layout: Layout
    values: dict[Column, tuple[float, ...]]
    residual: np.ndarray
    std: np.ndarray

    @property
    def chi2(self):
        return float(self.residual @ self.residual)


@dataclass(frozen=True, eq=False)
class State:
    fit: Fit


@dataclass(frozen=True, eq=False)
class Columns:
    """`y` by columns of unit noise; orthogonal ones unless they are made alike."""

    y: np.ndarray
    columns: dict[Column, np.ndarray]
    pressed: frozenset[Column] = frozenset()
    hidden: Column | None = None
    rare: frozenset[Column] = frozenset()
    usual: tuple[Column, Column] | None = None
    """Two forms of one effect, the usual one first."""
    led: Column | None = None
    """One that leads to a better fit of what it was added to, and falls away."""
    unlike: Column | None = None
    """One whose trials are like nothing: a rival where it stood before alone."""

    def fit(self, *terms):
        J = np.column_stack([self.columns[t] for t in terms]) if terms else np.empty((ROWS, 0))
        at = np.linalg.lstsq(J, self.y, rcond=None)[0]
        std = np.sqrt(np.diag(np.linalg.pinv(J.T @ J)))
        return Fit(Layout(terms), {t: (float(v),) for t, v in zip(terms, at, strict=True)}, self.y - J @ at, std)

    def state(self, *terms):
        return State(self.fit(*terms))

    def judged(self, state, rng):
        return [t for t in self.columns if t not in state.fit.values and t != self.hidden]

    def additions(self, state, judged):
        found = [(t, self.fit(*state.fit.values, t)) for t in judged]
        gains = [(Candidate(t, state.fit.chi2 - f.chi2, LOGN, t in self.pressed), f) for t, f in found]
        return [each for each in gains if each[0].chi2_gain > LOGN]

    def enlarged(self, state, larger):
        return State(larger)

    def reformed(self, state):
        return state

    def rarer(self, term, other):
        return term in self.rare and other not in self.rare

    def usual_form(self, term, other):
        return (term, other) == self.usual

    def begun_better(self, state, other):
        return self.led is not None and other.fit.chi2 < state.fit.chi2

    def unhidden(self, state, judged):
        if self.hidden is None or self.hidden in state.fit.values:
            return None
        return Unhidden(9.0, 5.0), self.state(*state.fit.values, self.hidden)

    def without(self, state, term):
        return self.fit(*(t for t in state.fit.values if t != term))

    def nearly_without(self, state, term, hopeless):
        less = self.without(state, term)
        return less if term != self.led else Fit(less.layout, less.values, state.fit.residual, less.std)

    def replaced(self, state, other):
        return State(other)

    def rivals(self, state, term, less, stood):
        others = [t for t in self.columns if t not in state.fit.values and (t != self.unlike or t in stood)]
        fits = [(t, self.fit(*less.values, t)) for t in others]
        found = [RivalTerm(t, f, f.chi2 - state.fit.chi2, f.chi2 - state.fit.chi2) for t, f in fits]
        return sorted(found, key=lambda r: r.bic_loss)

    def impossible(self, state, term):
        return term in self.pressed

    def merged(self, state, standing):
        return None


A, B, C, D = map(Column, "abcd")
E = np.eye(ROWS)
RNG = np.random.default_rng(0)


def wave(k):
    return E[k]


def test_a_term_that_leads_the_rest_to_a_better_fit_is_not_replaced_by_the_next_best():
    """As a delay that the clocks can take up: C, which does a part of what it did, is not added in its place."""
    columns = {A: wave(0), C: (wave(0) + wave(2)) / np.sqrt(2)}
    _, rounds, _ = forward(led := Columns(9 * wave(0), columns, led=A), led.state(), 9, RNG)
    assert rounds[0].after == ()

    class Deaf(Columns):
        def begun_better(self, state, other):
            return False

    _, rounds, _ = forward(deaf := Deaf(9 * wave(0), columns, led=A), deaf.state(), 9, RNG)
    assert rounds[0].after == (C,)


def test_columns_are_added_by_what_they_gain_until_none_pays():
    system = Columns(9 * wave(0) + 5 * wave(1) + 1 * wave(2), {A: wave(1), B: wave(0), C: wave(2)})
    last, rounds, _ = forward(system, system.state(), 9, RNG)
    assert list(last.fit.values) == [B, A]
    assert [one.model for one in rounds] == [(), (B,), (B, A)]
    assert [one.after for one in rounds] == [(B,), (B, A), None]
    assert {c.term for c in rounds[0].fitted} == {A, B}
    full, told, _ = forward(system, system.state(), 1, RNG)
    assert list(full.fit.values) == [B]
    assert told[-1].fitted == ()


def test_what_is_pressed_goes_last_and_what_is_known_is_not_tried_again():
    system = Columns(9 * wave(0) + 5 * wave(1), {A: wave(1), B: wave(0)}, frozenset({B}))
    assert list(forward(system, system.state(), 9, RNG)[0].fit.values) == [A, B]
    last, _, _ = forward(system, system.state(), 1, RNG, [frozenset({A})])
    assert list(last.fit.values) == [B], "of additions that are known the next best"


def test_what_hides_is_asked_for_where_nothing_else_lasts():
    system = Columns(4 * wave(0) + 5 * wave(1), {A: wave(1), D: wave(0)}, hidden=D)
    last, rounds, _ = forward(system, system.state(), 9, RNG)
    assert list(last.fit.values) == [A, D]
    assert [one.hidden is not None for one in rounds] == [False, True, False]
    full, _, _ = forward(system, system.state(), 1, RNG)
    assert list(full.fit.values) == [A, D], "though the model is full"
    two = Columns(4 * wave(0) + 5 * wave(1) + 5 * wave(2), {A: wave(1), C: wave(2), D: wave(0)}, hidden=D)
    assert list(forward(two, two.state(A, C), 1, RNG)[0].fit.values) == [A, C]
    weak = Columns(1 * wave(0) + 5 * wave(1), {A: wave(1), D: wave(0)}, hidden=D)
    assert list(forward(weak, weak.state(), 9, RNG)[0].fit.values) == [A], "pruned again: the model was there before"


def test_a_column_is_dropped_below_its_threshold_the_worst_first():
    least = float(np.sqrt(accept_threshold(1)))
    system = Columns((least + 0.1) * wave(0) + (least - 0.1) * wave(1), {A: wave(0), B: wave(1)})
    assert list(pruned(system, system.state(A, B)).fit.values) == [A]


def found_any(missing, _whole, _less, judged):
    return bool(missing & set(judged))


def test_a_model_that_is_asked_again_loses_what_no_screening_would_have_let_in():
    """`missed` is told what a screening finds; what is below the price of a term goes without being asked."""
    system = Columns(9 * wave(0) + 6 * wave(1) + 1 * wave(2), {A: wave(0), B: wave(1), C: wave(2)})
    for missing, left in (({A, B}, [A, B]), ({A}, [A]), (set(), [])):
        kept = asked_again(system, system.state(A, B, C), partial(found_any, missing), RNG)
        assert list(kept.fit.values) == left


def alike(share):
    """A column that is `share` of the first, the rest of it along one that nothing has."""
    return share * wave(0) + np.sqrt(1 - share**2) * wave(40)


def test_a_better_rival_takes_the_place_and_how_each_stands_is_told():
    system = Columns(9 * wave(0) + 5 * wave(1), {A: alike(0.9), B: wave(0), C: wave(1)})
    last, standing = exchanged(system, system.state(A, C))
    assert set(last.fit.values) == {B, C}
    assert standing is not None
    less, (rival,) = standing[B]
    assert list(less.values) == [C]
    assert rival.term == A
    assert np.isclose(rival.bic_loss, 81 * (1 - 0.9**2))


def test_an_exchange_leaves_no_term_behind_that_gives_nothing_any_more():
    """A knee and two small terms stood for a loss in the winding: once that had come, they stayed, worth nothing, each
    with a dozen rivals as good."""
    both = wave(0) + wave(1) + wave(2)
    system = Columns(9 * both, {A: wave(0), B: both, C: wave(1)})
    last, standing = exchanged(system, system.state(A, C))
    assert set(last.fit.values) == {B}
    assert standing is not None
    assert set(standing) == {B}


def test_what_was_exchanged_is_a_rival_of_what_took_its_place():
    """A stand that rings, as slow as a lag: none of its trials is like the lag, and it was never told of again."""
    system = Columns(9 * wave(0) + 5 * wave(1), {A: alike(0.95), B: wave(0), C: wave(1)}, unlike=A)
    _, standing = exchanged(system, system.state(A, C))
    assert standing is not None
    assert [rival.term for rival in standing[B][1]] == [A]
    _, standing = exchanged(system, system.state(B, C))
    assert standing is not None
    assert standing[B][1] == []


def test_what_has_impossible_values_gives_way_to_what_does_nearly_as_well():
    columns = {A: wave(0), B: alike(0.95)}
    whole = Columns(9 * wave(0), columns)
    assert list(exchanged(whole, whole.state(A))[0].fit.values) == [A]
    pressed = Columns(9 * wave(0), columns, frozenset({A}))
    assert list(exchanged(pressed, pressed.state(A))[0].fit.values) == [B]


def test_a_rarer_rival_comes_only_where_it_would_stay():
    """Better by 6 of BIC, it would go again for the ordinary one; better by more than rare ones must be, it stays."""
    for gain, last in ((6.0, A), (policy.select.RARE_TERM_BIC + 2.0, B)):
        y = 9 * wave(0) + np.sqrt(gain) * wave(1)
        system = Columns(y, {A: wave(0), B: y / np.linalg.norm(y)}, rare=frozenset({B}))
        end, standing = exchanged(system, system.state(A))
        assert list(end.fit.values) == [last]
        assert standing is not None


def test_of_two_that_gain_the_same_the_ordinary_one_is_added():
    """A rare one that gains 6 more waits; one that gains more than rare ones must is added."""
    for gain, first in ((6.0, A), (policy.select.RARE_TERM_BIC + 2.0, B)):
        y = 9 * wave(0) + np.sqrt(gain) * wave(1)
        system = Columns(y, {A: wave(0), B: y / np.linalg.norm(y)}, rare=frozenset({B}))
        assert list(forward(system, system.state(), 1, RNG)[0].fit.values) == [first]


def test_of_two_forms_that_gain_the_same_the_usual_one_is_added():
    """Rounding decided it: a step in thrust after a reversal, and what the next run needed was a wake that dies."""
    for more, first in ((0.2, A), (1.0, B)):
        y = 9 * wave(0) + np.sqrt(more) * wave(1)
        system = Columns(y, {A: wave(0), B: y / np.linalg.norm(y)}, usual=(A, B))
        assert list(forward(system, system.state(), 1, RNG)[0].fit.values) == [first]


def test_what_was_left_for_impossible_values_is_not_come_back_to():
    """A knee that fits better ended at what is possible once it was in the model, and went and came until the rounds
    were over: the limit of a drive had no name."""
    circle = Columns(9 * wave(0), {A: wave(0), B: alike(0.999)}, frozenset({A, B}))
    last, standing = exchanged(circle, circle.state(A))
    assert list(last.fit.values) == [B]
    assert set(standing) == {B}


def test_a_name_has_one_rival_of_each_effect_and_its_values_in_the_last_model():
    other, form = Column("b", "steep"), Column("a", "steep")
    system = Columns(9 * wave(0), {A: wave(0), B: alike(0.999), other: alike(0.998), form: alike(0.999), C: wave(3)})
    state = system.state(A)
    found = named_term(
        A,
        state.fit,
        (system.fit(), system.rivals(state, A, system.fit(), {})),
        (Check("own_covariate", "asked", "failed"),),
    )
    assert [r.term for r in found.rivals] == [B], "neither another form of its own, nor one twice, nor what is far off"
    assert found.chi2_gain == 81.0
    assert np.isclose(found.bic_gain, 81 - LOGN)
    assert found.failed_checks == ("failed",)
    loss = found.rivals[0].bic_loss
    assert np.isclose(found.probability, 1 / (1 + np.exp(-loss / 2)))
    twice = Columns(18 * wave(0), system.columns)
    (again,) = restated([found], twice.fit(A))
    assert again.theta == (18.0,)
    assert restated([found], twice.fit(B)) == [found]
