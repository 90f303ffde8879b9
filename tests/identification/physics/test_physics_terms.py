"""Every textbook form: absent at its neutral amount, seen at its trials, bounded, told in one sentence."""

import ast
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.predictor import predict
from identification.physics.catalogue import CATALOGUE
from identification.physics.term import STAGES
from identification.run_history.remembered import RememberedRun
from tests.identification.physics.one_term import H, S, base, term
from tests.identification.physics.runs_on_intervals import history, moment, scale

NAMES = [f"{t.id}-{t.form}" if t.form else t.id for t in CATALOGUE]


every_term = pytest.mark.parametrize("term", CATALOGUE, ids=NAMES)


def neutral(term):
    """Amounts that take the effect away; inner parameters from the first trial."""
    first = term.trials(S)[0]
    out = [p.neutral if p.neutral is not None else v for p, v in zip(term.parameters(S), first, strict=True)]
    names = [p.name for p in term.parameters(S)]
    if "share_2" in names:  # the second amount of a creep with two constants
        out[names.index("share_2")] = 0.0
    return tuple(out)


def predicted(terms, thetas, h=H, s=S, C=0.5, tare=0.0):
    """`h`: a history, or a run that remembers."""
    run = h if isinstance(h, RememberedRun) else RememberedRun(h)
    return predict(Model(tuple(terms)), Theta(C, tuple(thetas), (tare,)), run, s, tare)


@every_term
def test_a_neutral_amount_changes_nothing(term):
    F, _ = predicted([term], [neutral(term)])
    assert base() == pytest.approx(F, abs=1e-9 * S.thrust)


@every_term
def test_each_trial_is_seen_and_within_bounds(term):
    known = term.parameters(S)
    assert known[0].neutral is not None
    assert term.trials(S)
    for trial in term.trials(S):
        assert len(trial) == len(known)
        for p, value in zip(known, trial, strict=True):
            assert p.low < p.high
            assert p.low <= value <= p.high, p.name
            assert p.neutral is None or p.low <= p.neutral <= p.high
        assert trial[0] != known[0].neutral
        F, _ = predicted([term], [trial])
        assert np.all(np.isfinite(F))
        if not (term.id == "dead_band" and trial[0] < 1.0):  # no level of this run is so small
            assert np.max(np.abs(F - base())) > 3e-5 * S.thrust


@every_term
def test_the_prediction_moves_continuously_with_every_parameter(term):
    """A fit by slopes needs it: a small step of a parameter is a small step of the prediction, twice as far twice as
    much (or it passed a kink)."""
    for trial in term.trials(S)[:2]:
        middle, _ = predicted([term], [trial])
        for j, p in enumerate(term.parameters(S)):
            moved = []
            for step in (1e-7, 1e-5):
                at = list(trial)
                at[j] += step * (p.high - p.low) * (1 if trial[j] < 0.5 * (p.low + p.high) else -1)
                moved.append(np.linalg.norm(predicted([term], [tuple(at)])[0] - middle))
            assert moved[0] < 0.05 * moved[1] + 1e-9 * S.thrust


@every_term
def test_bounds_hold_nothing_that_is_not_finite(term):
    known = term.parameters(S)
    for corner in ([p.low for p in known], [p.high for p in known]):
        F, x = predicted([term], [tuple(corner)])
        assert np.all(np.isfinite(F))
        assert np.all(np.isfinite(x))


@every_term
def test_nothing_depends_on_one_bench_s_volts_and_newtons(term):
    """The same shape of run at 7 times the volts and 1/30 of the newtons: the same relative change."""
    other = history(volts=7.0, newtons=1 / 30, flow=3.0)
    s = scale(other, volts=7.0, newtons=1 / 30, flow=3.0)
    C = 0.5 / 30 / 49
    for mine, theirs in zip(term.trials(S), term.trials(s), strict=True):
        here, _ = predicted([term], [mine], tare=1.0)
        there, _ = predicted([term], [theirs], other, s, C, tare=1 / 30)
        sought = 1e-6 if term.id == "rotation_coupling" else 1e-8  # what an optimiser found beforehand is in it
        assert 30 * there == pytest.approx(here, abs=sought * S.thrust)


@every_term
def test_the_statement_is_one_sentence_with_its_number(term):
    for trial in term.trials(S):
        says = term.statement(trial, S)
        assert re.match(r"[A-Z][a-z-]+( [a-z-]+)*: ", says)
        assert says.endswith(".")
        assert not re.search(r"\.\s", says), "more than one sentence"
        assert re.search(r"\d", says)
        assert not re.search(r"\b(nan|inf)\b", says)
    elsewhere = tuple(0.3 * p.low + 0.7 * p.high for p in term.parameters(S))
    assert term.statement(elsewhere, S) != term.statement(term.trials(S)[0], S)


@every_term
def test_it_says_what_it_is_and_what_it_needs(term):
    assert term.stage in STAGES
    assert term.physics
    assert term.physics[0].islower()
    assert term.covariates
    assert set(term.needs) <= set(H.others)
    bare = replace(H, others={}, rate=None, rate_count=None, rate_sampled=None)
    if not term.needs:
        predicted([term], [term.trials(S)[-1]], bare)


def test_ids_and_forms_are_unique():
    assert len({(t.id, t.form) for t in CATALOGUE}) == len(CATALOGUE)
    assert len({t.id for t in CATALOGUE}) == 27


@every_term
def test_finer_trials_reach_to_the_neighbours(term):
    where = 1 if term.id == "stand_resonance" else -1  # frequency, or place of the jump
    places = sorted({t[where] for t in term.trials(S)})
    for trial in term.trials(S):
        finer = np.array(term.finer(trial, S))
        if finer.size:
            tried = np.unique(np.abs(finer[:, where]))  # a delay has both signs
            at = places.index(trial[where])
            assert tried.min() <= 0.05 * places[at] + 0.95 * places[max(at - 1, 0)]
            assert tried.max() >= 0.05 * places[at] + 0.95 * places[min(at + 1, len(places) - 1)]
            assert np.all(np.diff(tried) < 0.2 * np.maximum(max(np.diff(places).min(), trial[where]), tried[1:]))


def test_only_jumps_delays_and_ringing_have_finer_trials():
    finer = {(t.id, t.form) for t in CATALOGUE if t.finer(t.trials(S)[0], S)}
    assert finer == {("zero_offset", ""), ("dead_band", "jump"), ("stand_resonance", ""), ("time_skew", "")}


def test_terms_act_in_the_order_of_the_bench():
    clip, uneven_blade, linear = term("command_saturation"), term("asymmetry"), term("load_cell_nonlinearity")
    F, x = predicted(Model().plus(linear).plus(uneven_blade).plus(clip).terms, [(8.0,), (0.5,), (1e-3,)])
    volts = np.clip(H.driver, -8, 8)
    T = np.where(volts < 0, 0.5, 1.0) * 0.5 * volts * np.abs(volts)
    assert x == pytest.approx(volts)
    assert pytest.approx(T * (1 + 1e-3 * np.abs(T))) == F


def test_a_term_that_reads_the_measured_rate_does_not_explain_that_rate():
    F, x = predicted([term("rotation_coupling")], [(1.0,)])
    assert np.array_equal(x, H.driver)
    n = term("rotation_coupling").apply(H.driver, moment(H, S), (1.0,))
    assert not np.allclose(n, x, atol=0.1)
    assert pytest.approx(0.5 * n * np.abs(n)) == F


def test_what_is_remembered_is_what_is_computed():
    fresh, old = history(), RememberedRun(history())
    lag, clip = term("motor_lag"), term("load_cell_saturation")
    for C, tau, limit, tare in [
        (0.5, 0.1, 60.0, 0.0),
        (0.5, 0.1, 50.0, 3.0),
        (0.6, 0.1, 50.0, 3.0),
        (0.5, 0.1, 60.0, 0.0),
    ]:
        again, _ = predicted([lag, clip], [(tau,), (limit,)], old, S, C, tare)
        first, _ = predicted([lag, clip], [(tau,), (limit,)], fresh, S, C, tare)
        assert np.array_equal(again, first)


def test_the_engine_names_no_effect():
    """Groups of effects are traits of the terms: adding one is its file, its page, its line in the catalogue."""
    ids = {term.id for term in CATALOGUE} - {"current"}
    engine = Path(__file__).parents[3] / "identification" / "mismatch"
    found = [
        (path.name, node.value)
        for path in engine.rglob("*.py")
        if "vehicle" not in path.parts
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and node.value in ids
    ]
    assert found == []
    rooms = {term.__class__.__module__ for term in CATALOGUE}
    reached = [
        path.name for path in engine.rglob("*.py") if rooms & set(re.findall(r"from (\S+) import", path.read_text()))
    ]
    assert reached == []


def test_an_exponent_far_below_a_propellers_says_what_the_drive_may_hold():
    exponent = term("exponent")
    assert "a drive that regulates torque" in exponent.statement((0.65,), S)
    assert "drive" not in exponent.statement((1.9,), S)
    assert "drive" not in exponent.statement((0.65,), replace(S, driver_unit="rev/s")), "a measured rate has none"


@pytest.mark.parametrize(
    ("id", "form", "most"), [("load_cell_creep", "one_constant", 0.1), ("load_cell_nonlinearity", "cubic", 0.12)]
)
def test_no_cell_in_service_is_off_by_more(id, form, most):
    known = term(id, form).parameters(S)[0]
    largest = S.thrust**2 if form == "cubic" else 1.0
    assert (known.low * largest, known.high * largest) == pytest.approx((-most, most))
