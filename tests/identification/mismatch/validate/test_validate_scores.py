"""What was not fitted: which rows those are, what a score is, and which terms it sends away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.model.model import Given, Model
from identification.mismatch.name.naming import Check, name
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.validate import stage
from identification.mismatch.validate.cross_validation import by_folds
from identification.mismatch.validate.held_out import (
    KEPT_BACK,
    Score,
    blocks,
    by_blocks,
    by_runs,
    judge_blocks,
    judge_runs,
    least_noise,
    noise_rms,
    refitted,
    rmse,
    with_tares,
)
from identification.mismatch.validate.prediction import (
    predicting,
    predicts,
    unproven_changes,
    without_each,
    worse_predicted,
)
from identification.mismatch.validate.train_test_split import better, train_test_split
from identification.physics.dead_band import DeadBand
from identification.physics.speed_of_advance import SpeedOfAdvance
from identification.physics.time_skew import TimeSkew
from identification.physics.zero_offset import ZeroOffset
from identification.recording import Channel, Recording
from tests.identification.diagnosed_runs import NOISE, C, dead_band, table
from tests.identification.mismatch.small import data_of, history, known_noise, placed, short, white

BAND, JUMP, SKEW = DeadBand(), ZeroOffset(), TimeSkew()
RAMPS = 400.0
"""s."""
QUIET = Noise(NOISE**2, 0.0)


def banded(width=1.2, **how):
    return short(volts=dead_band(width), **how)


@pytest.fixture(scope="module")
def fitted():
    """One run of a dead band: the baseline and the true model."""
    data, before = known_noise({}, [banded()])
    _, after = known_noise({BAND: (1.0,)}, [banded()])
    return data, before, after


# ---------------------------------------------------------------- which rows


def test_every_fourth_block_of_time_is_kept_back():
    h = history(banded(seconds=160.0))
    keep = blocks(h)
    t = h.sampled[h.rows]
    assert np.mean(keep) == pytest.approx(1 - 1 / KEPT_BACK, abs=0.06)
    ends = t[1:][np.diff(keep.astype(int)) != 0]
    lengths = np.diff(ends)
    assert np.min(lengths) > 5.0, "whole blocks, longer than slow noise is alike"
    assert len(set(np.abs(h.driver[h.rows][~keep]).round(6))) == 7, "all levels are in both shares"


def test_of_a_table_every_fourth_level_is_kept_back():
    keep = blocks(history(table(lambda v: C * v * np.abs(v))))
    assert np.flatnonzero(~keep).tolist() == list(range(2, 41, 4))


# ---------------------------------------------------------------- scores


def test_an_error_is_that_of_every_sample_whatever_the_rows(fitted):
    """Means of rows and the scatter within them, beside the samples themselves."""
    recording = banded(rate=50.0)
    data, estimate = known_noise({BAND: (1.0,)}, [recording])
    every = [np.ones(r.size, dtype=bool) for r in data.rows]
    assert np.max(data.histories[0].count) > 1
    found = rmse(estimate.fit.model, estimate.fit.theta, data, every)
    theta = estimate.fit.theta
    h = data.histories[0]
    command = recording.first_of("command_voltage")
    V = np.nan_to_num(command.held_at(h.sample_time))
    x = np.sign(V) * np.maximum(np.abs(V) - theta.terms[0][0], 0.0)
    left = h.sample_thrust - theta.C * x * np.abs(x) - theta.tares[0]
    assert found == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-3)
    assert np.isnan(rmse(theta=theta, model=estimate.fit.model, data=data, which=[~k for k in every]))


def ramps(noise: float) -> Recording:
    """Up and down in ticks of 40 ms, the force read 82 times a second: too many for rows of their own."""
    when = np.arange(0.0, RAMPS, 0.04)
    level = 9.0 * np.sin(2 * np.pi * when / 20.0)
    t = np.arange(0.005, RAMPS, 1 / 82.15)
    V = level[np.searchsorted(when, t, side="right") - 1]
    F = C * V * np.abs(V) + np.random.default_rng(4).normal(0.0, noise, t.size)
    command = Channel("command_voltage", "command", "command_voltage", "V", when, level)
    return Recording("ramps", "T1", (command, Channel("thrust", "cell", "thrust", "N", t, F)))


def test_on_a_ramp_the_scatter_within_a_row_is_about_what_is_foretold_of_each_sample():
    data, estimate = known_noise({}, [ramps(0.005)], 0.005)
    assert np.count_nonzero(data.histories[0].count > 1) > 100
    every = [np.ones(r.size, dtype=bool) for r in data.rows]
    assert rmse(estimate.fit.model, estimate.fit.theta, data, every) == pytest.approx(0.005, rel=0.1)


def test_what_the_noise_alone_gives(fitted):
    data, _, after = fitted
    every = [np.ones(r.size, dtype=bool) for r in data.rows]
    noise = Noise(0.04, 0.0009, (1.0,), (0.01,), ((3.0, 4.0),), (0.02,))
    V = data.histories[0].driver[data.rows[0]]
    width, C_ = after.fit.theta.terms[0][0], after.fit.theta.C
    F = C_ * np.maximum(np.abs(V) - width, 0.0) ** 2
    expected = np.sqrt(0.04 + 0.03 + 0.0009 * np.mean(F**2))
    assert noise_rms(noise, after.fit.model, after.fit.theta, data, every) == pytest.approx(expected, rel=0.01)
    loud, quiet = Noise(9.0, 0.0), Noise(0.01, 0.0)
    assert least_noise(after.fit, (loud, quiet), data, every) == pytest.approx(0.1)
    assert least_noise(after.fit, (loud,), data, every) == pytest.approx(NOISE, rel=0.1)


def test_tares_are_what_each_run_wants():
    data, theta = data_of([banded(seed=1, tare=5.0), banded(seed=2, tare=-3.0)])
    model, begin = placed({BAND: (1.2,)}, replace(theta, C=C, tares=(0.0, 0.0)))
    assert with_tares(model, begin, data).tares == pytest.approx((5.0, -3.0), abs=0.1)


def test_what_is_kept_back_is_not_looked_at(fitted):
    """Rubbish in the blocks that judge changes no parameter; in the others it does."""
    data, _, after = fitted
    keep = [blocks(h) for h in data.histories]
    clean = refitted(after, data, keep)
    h = data.histories[0]
    back = h.rows[~keep[0]]
    spoiled = h.thrust.copy()
    spoiled[back] = 1e3
    told = refitted(after, replace(data, histories=(replace(h, thrust=spoiled),)), keep)
    assert told.theta.vector == pytest.approx(clean.theta.vector, rel=1e-9)
    ends = h.thrust.copy()
    ends[h.rows[keep[0]]] += 5.0
    moved = refitted(after, replace(data, histories=(replace(h, thrust=ends),)), keep)
    assert moved.theta.tares[0] == pytest.approx(clean.theta.tares[0] + 5.0, abs=0.05)


def test_blocks_and_runs_judge_both_models(fitted):
    data, before, after = fitted
    held = by_blocks(before, after, data, data, QUIET)
    assert held.before > 3 * NOISE
    assert held.after == pytest.approx(NOISE, rel=0.12)
    assert held.noise == pytest.approx(NOISE, rel=0.1)
    assert "every fourth of the blocks of time" in held.what
    others = [history(banded(seed=7, tare=-9.0))]
    whole = by_runs(before, after, data, others, QUIET)
    assert whole.after == pytest.approx(NOISE, rel=0.12)
    assert whole.before > 3 * NOISE
    assert others[0].recording_id in whole.what
    honest = by_runs(before, after, data, [history(short(seed=7))], QUIET)
    assert honest.after > 10 * NOISE, "a run without the effect"


def test_periodic_disturbances_count_against_the_model_before_alone(fitted):
    data, before, after = fitted
    h = data.histories[0]
    hummed = h.sample_thrust + np.sqrt(2) * np.sin(2 * np.pi * 7.3 * h.sample_time)
    mean = np.where(h.count > 0, h.thrust_samples.means(hummed), np.nan)
    humming = replace(data, histories=(replace(h, sample_thrust=hummed, thrust=mean),))
    held = by_blocks(before, after, data, humming, QUIET)
    plain = by_blocks(before, after, data, data, QUIET)
    assert held.after == plain.after
    assert held.before == pytest.approx(np.hypot(plain.before, 1.0), rel=0.03)


# ---------------------------------------------------------------- cross-validation


def pooled(values, runs):
    data, before = known_noise({}, runs)
    _, after = known_noise(values, runs)
    return data, before, after


@pytest.mark.parametrize(("many", "says"), [(3, "each run by a model"), (6, "each of 4 groups of runs by a model")])
def test_each_run_is_judged_by_the_others(many, says):
    """Its own numbers by hand: fit without the run, tare of the run, error on it. One run has another dead band."""
    runs = [banded(1.2 + 0.4 * (s == 1), seed=s, tare=float(s), seconds=50.0) for s in range(many)]
    data, before, after = pooled({BAND: (1.0,)}, runs)
    held = by_folds(before, after, data, data, QUIET)
    assert held.what.startswith(says)
    assert 1.5 * NOISE < held.after < 0.7 * held.before
    squares, samples = [], []
    for fold in np.array_split(np.arange(many), min(many, 4)):
        rest, theta = data_of([r for i, r in enumerate(runs) if i not in fold])
        model, begin = placed({BAND: (1.0,)}, theta)
        alone = fit(model, begin, rest, white(rest, model, begin))
        unseen, _ = data_of([runs[i] for i in fold])
        every = [np.ones(r.size, dtype=bool) for r in unseen.rows]
        squares.append(rmse(model, with_tares(model, alone.theta, unseen), unseen, every) ** 2)
        samples.append(sum(h.count.sum() for h in unseen.histories))
    assert held.after == pytest.approx(np.sqrt(np.average(squares, weights=samples)), rel=1e-3)


def test_one_run_or_one_that_is_no_match_is_judged_by_blocks(fitted):
    data, before, after = fitted
    assert "blocks of time" in by_folds(before, after, data, data, QUIET).what
    data, before, after = pooled({BAND: (1.0,)}, [banded(), banded(seed=1, seconds=20.0)])
    assert "blocks of time" in by_folds(before, after, data, data, QUIET).what


# ---------------------------------------------------------------- judges


def test_a_split_is_fitted_to_one_part_and_judged_on_the_rest(fitted):
    data, before, after = fitted
    split = train_test_split(after, data, ())
    assert split.data.size + sum(int((~k).sum()) for k in split.data.keep) == data.size
    good = split.judge(split.estimate.fit)
    bad = split.judge(fit(before.fit.model, before.fit.theta, split.data, split.estimate.weights))
    assert good.rmse < bad.rmse
    n = data.size - split.data.size
    assert good.chi2 == pytest.approx(n, abs=5 * np.sqrt(2 * n))
    again = judge_blocks(after, data, split.data.keep)(split.estimate.fit)
    assert again == good
    whole = train_test_split(after, data, [history(banded(seed=5))])
    assert whole.data is data
    assert whole.estimate is after
    assert whole.judge(after.fit).rmse == pytest.approx(NOISE, rel=0.12)


def test_a_fit_that_needs_what_a_run_lacks_is_infinitely_bad(fitted):
    data, _, after = fitted
    flow = SpeedOfAdvance()
    bigger, theta = after.fit.more(flow, flow.trials(replace(data.scale, flow=1.0))[0])
    judge = judge_runs(after, data, [history(banded(seed=5))])
    needing = replace(after.fit, model=bigger, theta=theta)
    assert judge(needing) == Score(float("inf"), float("inf"))


@pytest.mark.parametrize(
    ("new", "parameters", "found"),
    [
        (Score(1.0, 99.0), 0, True),
        (Score(1.0, 101.0), 0, False),
        (Score(1.0, 99.0), 3, False),
        (Score(1.0, 60.0), 3, True),
        (Score(9.0, 60.0), 0, False),
    ],
)
def test_better_is_by_more_than_chance_and_no_worse_in_newtons(new, parameters, found):
    assert better(new, Score(1.0, 100.0), parameters) is found


# ---------------------------------------------------------------- what must predict


def knocked(t, _V, F):
    """The zero moved for a while: it is back in the last block, which judges."""
    return F + 3.0 * ((t > 64.0) & (t < 80.0))


def test_names_without_which_the_rest_is_predicted_better_are_sent_away(fitted):
    data, _, after = fitted
    split = train_test_split(after, data, [history(short(seed=5))])
    assert worse_predicted(without_each(split, [BAND], same_run=False), same_run=False) == (BAND,)
    assert worse_predicted(without_each(split, [], same_run=False), same_run=False) == ()
    assert worse_predicted(without_each(train_test_split(after, data, ()), [BAND], same_run=True), same_run=True) == ()


@pytest.mark.parametrize(("was", "proven"), [(1.0, True), (1.199, False)])
def test_another_amount_of_what_was_there_must_predict(was, proven):
    """A dead band of 1.2 V is a change of one of 1.0 V, and none of one of 1.199 V, whatever a fit makes of it."""
    data, theta = data_of([banded(seed=3)])
    model = Model((BAND,), (Given(BAND, (was,), data.scale),))
    begin = replace(theta, terms=((1.2,),))
    w = white(data, model, begin)
    after = Estimate(fit(model, begin, data, w), Noise(NOISE**2, 0.0), None, w, data.thrust_rows)
    scores = without_each(train_test_split(after, data, ()), [BAND], same_run=True)
    assert unproven_changes(model, scores) == (() if proven else (BAND,))
    assert unproven_changes(Model((BAND,)), scores) == (), "it is no change of anything"


def test_a_clock_or_a_jump_of_one_run_is_not_asked_of_another():
    """A run without it sends a dead band away, and neither a jump of the zero nor a clock."""
    recording = banded(change=lambda t, _V, F: F + 2.0 * (t > 40.0))
    data, after = known_noise({BAND: (1.0,), JUMP: (2.0, 40.0), SKEW: (0.05,)}, [recording])
    split = train_test_split(after, data, [history(short(seed=5))])
    assert worse_predicted(without_each(split, [BAND, JUMP, SKEW], same_run=False), same_run=False) == (BAND,)
    assert JUMP in worse_predicted(without_each(split, [BAND, JUMP, SKEW], same_run=True), same_run=True)


def test_a_term_without_a_name_stays_where_it_predicts_and_goes_where_it_only_describes(fitted):
    data, _, after = fitted
    kept = predicting(after, train_test_split(after, data, ()), data, [BAND], [BAND], ())
    assert kept is after
    data, now = known_noise({JUMP: (3.0, 64.0)}, [short(change=knocked, seconds=88.0)])
    gone = predicting(now, train_test_split(now, data, ()), data, [JUMP], [JUMP], ())
    assert gone.fit.model.terms == ()
    assert predicting(now, train_test_split(now, data, ()), data, [JUMP], [], ()) is now


def test_a_model_predicts_where_it_does_better_than_the_baseline(fitted):
    data, before, after = fitted
    assert predicts(after, before, data, ())
    assert not predicts(before, after, data, ())
    assert predicts(after, before, data, [history(banded(seed=5))])
    assert not predicts(after, before, data, [history(short(seed=5))])


def test_the_stage_parts_names_into_those_that_predict_and_those_that_do_not(fitted):
    data, _, after = fitted
    named = name(after, data, [])
    good = stage.run(after, named, data, ())
    assert [n.term for n in good.earned] == [BAND]
    assert good.unearned == ()
    bad = stage.run(after, named, data, [history(short(seed=5))])
    assert bad.earned == ()
    assert bad.unearned[0].failed_checks == ("what was not fitted is predicted better without it",)
    doubted = [n.asked(Check("own_covariate", "so", "odd")) for n in named]
    assert stage.run(after, doubted, data, [history(short(seed=5))]).unearned[0].failed_checks == ("odd",)


@pytest.mark.parametrize(
    ("unseen", "flexible", "says"),
    [(True, False, "whole runs not fitted"), (False, True, "blocks of time"), (False, False, "each run")],
)
def test_which_judge_is_asked(unseen, flexible, says):
    data, before, after = pooled({BAND: (1.0,)}, [banded(seed=s, seconds=50.0) for s in (0, 1)])
    others = [history(banded(seed=5))] if unseen else ()
    assert says in stage.score(before, after, data, data, others, QUIET, flexible=flexible).what
