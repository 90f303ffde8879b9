"""The screening on directions made by hand: its scores, its null distribution, and what is taken out of it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from identification.mismatch import policy
from identification.mismatch.estimate.fitting import fit, residual_of
from identification.mismatch.select.family_wise import (
    lengths,
    matching_pursuit,
    normal_scores,
    orthogonal_basis,
    quiet,
    surrogate_scores,
)
from identification.mismatch.select.screening import Directions, directions, refined, screen
from identification.mismatch.select.shape_error import allowed, allowed_in, corrections
from identification.physics.asymmetry import Asymmetry
from identification.physics.catalogue import CATALOGUE
from identification.physics.dead_band import DeadBand
from identification.physics.exponent import Exponent
from identification.physics.time_skew import TimeSkew
from tests.identification.diagnosed_runs import dead_band
from tests.identification.mismatch.small import data_of, known_noise, placed, rng, short, white

N = 600


def made(columns, one_sided=None):
    """Unit directions, each of another term."""
    columns = columns / np.linalg.norm(columns, axis=0)
    q = columns.shape[1]
    terms = [*CATALOGUE][:q]
    sided = (False,) * q if one_sided is None else one_sided
    return Directions(tuple(terms), tuple((float(j),) for j in range(q)), sided, columns, np.ones(q))


def left(residual):
    """A fit that leaves this."""
    _, estimate = known_noise({}, [short(seconds=20.0, rate=4.0)])
    return replace(estimate.fit, residual=residual, jacobian=np.empty((residual.size, 0)))


def correlated(q=8, seed=1):
    """Directions of which neighbours are much alike."""
    base = rng(seed).standard_normal((N, q))
    return made(base + 0.9 * np.roll(base, 1, axis=1))


# ---------------------------------------------------------------- the judgement


def test_family_wise_p_values_are_even_under_white_noise():
    """Of 150 residuals with nothing in them; a test of the largest alone would call half of them below a tenth."""
    found = correlated()
    p = np.array([screen(left(rng(s).standard_normal(N)), found, rng(s)).p_value for s in range(150)])
    for level in (0.1, 0.3, 0.6):
        share, error = np.mean(p < level), np.sqrt(level * (1 - level) / p.size)
        assert share < level + 3.5 * error
        assert share > level - 3.5 * error - 0.08, "nor far too large"


def test_the_threshold_is_that_of_the_largest_of_many():
    """Orthogonal directions: the quantile of the largest of q normal deviates."""
    q, alarm = 20, policy.select.SCREENING_FALSE_ALARM
    found = made(np.linalg.qr(rng(2).standard_normal((N, q)))[0])
    judged = screen(left(rng(3).standard_normal(N)), found, rng(0))
    expected = norm.isf(0.5 * (1 - (1 - alarm) ** (1 / q)))
    assert judged.threshold == pytest.approx(expected, rel=0.08)


def test_what_is_plainly_there_is_seen_and_does_not_hide_itself():
    """The null is drawn from the residual; with a direction of 60 sigma in it it would be six times as wide."""
    found = correlated()
    loud = left(rng(4).standard_normal(N) + 60.0 * found.columns[:, 3])
    judged = screen(loud, found, rng(0))
    assert int(np.argmax(judged.z)) == 3
    assert judged.largest == pytest.approx(60.0, abs=3.0)
    assert judged.p_value < 1e-8
    assert judged.threshold < 4.5
    assert judged.best(1)[0][0] is found.terms[3]


def test_scores_are_correlations_and_physics_has_a_sign():
    found = replace(correlated(3), one_sided=(True, False, True))
    residual = -5.0 * found.columns[:, 0] + 0.01 * rng(5).standard_normal(N)
    judged = screen(left(residual), found, rng(0))
    score = found.columns.T @ residual
    assert judged.z == pytest.approx([0.0, abs(score[1]), max(score[2], 0.0)])


def test_what_shape_error_may_leave_is_spared():
    found = correlated(3)
    residual = 6.0 * found.columns[:, 1]
    spared = screen(left(residual), found, rng(0), np.array([0.0, 2.5, 100.0]))
    plain = screen(left(residual), found, rng(0))
    assert spared.z == pytest.approx(np.maximum(plain.z - [0.0, 2.5, 100.0], 0.0))
    assert spared.plain == pytest.approx(plain.z)


def test_nothing_to_look_at_is_judged_as_nothing():
    none = Directions((), (), (), np.empty((N, 0)), np.empty(0))
    judged = screen(left(rng(6).standard_normal(N)), none, rng(0))
    assert (judged.p_value, judged.largest, judged.threshold) == (1.0, 0.0, np.inf)


def test_the_best_are_each_named_once_and_no_fainter_than_asked():
    columns = rng(7).standard_normal((N, 4))
    found = replace(made(columns), terms=(DeadBand(), DeadBand(), Asymmetry(), Exponent()))
    residual = found.columns @ np.array([8.0, 9.0, 7.0, 1.0])
    judged = screen(left(residual), found, rng(0))
    assert [t for t, _, _ in judged.best(4, share=0.5)] == [DeadBand(), Asymmetry()]
    assert judged.best(4, share=0.5)[0][1] == (1.0,), "by its best trial"
    assert len(judged.best(4, share=0.0)) == 3
    assert len(judged.best(1, share=0.0)) == 1


# ---------------------------------------------------------------- draws


def test_surrogates_keep_what_blocks_hold_and_normal_draws_are_those_of_the_directions():
    """Their variance: of blocks the sum of squared sums, of white noise the directions' own Gram matrix."""
    found, residual = correlated(4), rng(8).standard_normal(N)
    edges = np.linspace(0, N, 121).astype(int)
    sums = np.array([found.columns[a:b].T @ residual[a:b] for a, b in pairwise(edges)])
    draws = surrogate_scores(found.columns, residual, rng(1))
    assert np.mean(draws, axis=0) == pytest.approx(np.zeros(4), abs=0.15)
    assert np.cov(draws.T) == pytest.approx(sums.T @ sums, abs=0.2)
    normal = normal_scores(found.columns, rng(2))
    assert np.cov(normal.T) == pytest.approx(found.columns.T @ found.columns, abs=0.08)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 1000), st.integers(1, 5))
def test_matching_pursuit_takes_what_least_squares_would(seed, many):
    """Of columns that were put in: what is left is the residual of a regression on those chosen."""
    found = correlated(8, seed)
    chosen = rng(seed).permutation(8)[:many]
    residual = found.columns[:, chosen] @ (30.0 * rng(seed + 1).choice([-1, 1], many)) + rng(seed).standard_normal(N)
    picked, rest = matching_pursuit(found.columns, residual, 5.0, 8)
    X = found.columns[:, picked]
    beta = np.linalg.lstsq(X, residual, rcond=None)[0]
    assert rest == pytest.approx(residual - X @ beta, abs=1e-6)
    assert len(set(picked)) == len(picked)
    if picked:
        assert np.linalg.norm(rest) < np.linalg.norm(residual)


def test_matching_pursuit_takes_nothing_from_noise_and_no_more_than_it_may():
    found = correlated(8)
    picked, rest = matching_pursuit(found.columns, rng(3).standard_normal(N), 5.0, 8)
    assert picked == []
    assert np.array_equal(rest, rng(3).standard_normal(N))
    loud = found.columns @ np.full(8, 40.0) + rng(4).standard_normal(N)
    assert len(matching_pursuit(found.columns, loud, 5.0, 2)[0]) == 2
    assert np.std(quiet(rng(5).standard_normal(N) + 40 * found.columns[:, 2], found.columns)) < 1.2


def test_a_basis_spans_its_columns_and_is_orthonormal():
    columns = rng(9).standard_normal((50, 4))
    columns = np.column_stack([columns, columns[:, 0] + 1e3 * columns[:, 1], np.zeros(50)])
    basis = orthogonal_basis(columns)
    assert basis.shape == (50, 4)
    assert basis.T @ basis == pytest.approx(np.eye(4), abs=1e-10)
    assert columns - basis @ (basis.T @ columns) == pytest.approx(np.zeros((50, 6)), abs=1e-9)
    assert lengths(columns) == pytest.approx(np.linalg.norm(columns, axis=0))
    assert orthogonal_basis(np.empty((50, 0))).shape == (50, 0)


# ---------------------------------------------------------------- directions of the catalogue


@pytest.fixture(scope="module")
def bare():
    data, estimate = known_noise({}, [short(volts=dead_band(0.6))])
    return data, estimate


def test_a_direction_is_the_change_by_a_trial_beside_what_the_model_can_follow(bare):
    """Frisch and Waugh: what is left of it in a regression on the model's own slopes."""
    data, estimate = bare
    band = DeadBand()
    found = directions(estimate.fit, data, estimate.weights, [band])
    assert set(found.terms) == {band}
    h, r = data.histories[0], data.rows[0]
    V, C = h.driver[r], estimate.fit.theta.C
    for j, (width,) in enumerate(found.values):
        x = np.sign(V) * np.maximum(np.abs(V) - width, 0.0)
        change = (C * x * np.abs(x) - C * V * np.abs(V)) * np.sqrt(h.count[r]) / 0.3
        slopes = np.column_stack([V * np.abs(V), np.ones(V.size)]) * np.sqrt(h.count[r])[:, None]
        rest = change - slopes @ np.linalg.lstsq(slopes, change, rcond=None)[0]
        assert found.sizes[j] == pytest.approx(np.linalg.norm(rest), rel=1e-3)
        assert found.columns[:, j] == pytest.approx(rest / np.linalg.norm(rest), abs=1e-3)


def test_what_the_model_can_follow_itself_is_no_direction(bare):
    """More of the dead band that is in it, and another trial of a term that changes nothing."""
    data, before = bare
    band = DeadBand()
    model, theta = placed({band: (0.6,)}, before.fit.theta)
    now = fit(model, theta, data, before.weights)
    found = directions(now, data, before.weights, [Asymmetry()], ((1.0,), (0.9,)))
    assert found.values == ((0.9,),)


def test_the_true_effect_stands_out_of_the_whole_catalogue(bare):
    data, estimate = bare
    terms = [t for t in CATALOGUE if not t.needs]
    judged = screen(estimate.fit, directions(estimate.fit, data, estimate.weights, terms), rng(0))
    assert judged.p_value < 1e-9
    assert "dead_band" in {t.id for t, _, _ in judged.best(4)}


def test_the_likeliest_delay_is_that_of_least_chi_square():
    late = short(change=lambda t, _V, F: np.interp(t - 0.21, t, F), rate=20.0)
    data, theta = data_of([late])
    model, begin = placed({}, theta)
    w = white(data, model, begin)
    now = fit(model, begin, data, w)
    skew = TimeSkew()
    (found,) = refined(now, data, w, skew, (0.1,))

    def cost(delay):
        bigger, at = now.more(skew, (delay,))
        r = residual_of(bigger, at, data, w)
        return float(r @ r)

    assert cost(found) <= 1.0001 * min(map(cost, np.linspace(0.05, 0.4, 71).tolist()))
    assert found == pytest.approx(0.21, abs=0.05), "samples are a twentieth of a second apart"


def test_terms_without_finer_trials_stay_where_they_are(bare):
    data, estimate = bare
    assert refined(estimate.fit, data, estimate.weights, DeadBand(), (0.3,)) == (0.3,)


# ---------------------------------------------------------------- shape error


def test_corrections_are_what_each_term_changes_beside_gain_and_zero():
    data, estimate = known_noise({DeadBand(): (1.0,)}, [short(volts=dead_band(1.5))])
    (change,) = corrections(estimate.fit, data, estimate.weights)
    h, r = data.histories[0], data.rows[0]
    V, C = h.driver[r], estimate.fit.theta.C
    (width,) = estimate.fit.values[DeadBand()]
    x = np.sign(V) * np.maximum(np.abs(V) - width, 0.0)
    raw = C * (x * np.abs(x) - V * np.abs(V)) * np.sqrt(h.count[r]) / 0.3
    slopes = np.column_stack([x * np.abs(x), np.ones(V.size)]) * np.sqrt(h.count[r])[:, None]
    beside = raw - slopes @ np.linalg.lstsq(slopes, raw, rcond=None)[0]
    assert change == pytest.approx(beside, abs=5e-3), "the fit's slopes are those a fraction of a sigma before its end"
    assert corrections(known_noise({}, [short(seconds=20.0)])[1].fit, data, estimate.weights) == []


def test_no_more_is_allowed_than_a_share_of_the_correction():
    """Never beyond its whole length; all of it where it is; by directions, and in a span."""
    change = rng(1).standard_normal(N)
    size = float(np.linalg.norm(change))
    unit = np.column_stack([np.sign(change) / np.sqrt(N), np.eye(N)[:, 0], change / size])
    found = allowed([change, change], unit, 0.05)
    assert found[0] == pytest.approx(2 * 0.05 * np.sum(np.abs(change)) / np.sqrt(N))
    assert found[1] == pytest.approx(2 * 0.05 * abs(change[0]))
    assert found[2] == pytest.approx(2 * 0.05 * size)
    assert np.all(found <= 2 * 0.05 * size + 1e-12)
    share = policy.select.SHAPE_ERROR
    assert allowed_in([change], np.linalg.qr(unit)[0]) <= share**2 * size**2 + 1e-9
    assert allowed_in([], unit) == 0.0
