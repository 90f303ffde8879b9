"""Comparison of thrusters and campaigns: false alarms and power are what they are said to be."""

from dataclasses import replace

import numpy as np
import pytest

from identification.thruster.comparison import (
    ALPHA,
    MANY,
    Group,
    changes,
    comparable,
    difference,
    holm,
    homogeneity,
    odd_ones,
    pairs,
    share_calibration,
    smallest_change,
)
from identification.thruster.repeatability import repeatability, with_repeatability

DOF = 11.0
CELL = 'load_cell/thrust {"gain_std": 0.01}'


def drawn(rng, truths, std=0.001, dof=DOF, p=1, gain=0.0, gain_std=0.0):
    """Thrusters with true C `truths`, standard errors known from `dof` degrees, one gain error for all."""
    names = ("C",) if p == 1 else ("C_plus", "C_minus")
    found = []
    for i, truth in enumerate(truths):
        s = std * (1 + 0.5 * (i % 3))
        mean = (truth + s * rng.standard_normal(p)) * (1 + gain)
        cov = np.diag(np.full(p, s**2 * rng.chisquare(dof) / dof))
        found.append(Group(f"T{i + 1}", names, mean, cov, dof, gain_std, CELL))
    return found


@pytest.mark.parametrize(("p", "low", "high"), [(1, 0.03, 0.075), (2, 0.035, 0.09)])
def test_false_alarms_among_eight_alike_thrusters(p, low, high):
    rng = np.random.default_rng(7)
    alarms = [homogeneity(drawn(rng, [0.4] * 8, p=p)).differ for _ in range(1000)]
    assert low <= np.mean(alarms) <= high


def test_an_odd_one_is_named_and_only_it():
    rng = np.random.default_rng(8)
    named = [odd_ones(drawn(rng, [0.4] * 5 + [0.41] + [0.4] * 2))[0] for _ in range(300)]
    assert np.mean(["T6" in names for names in named]) > 0.83
    assert np.mean([bool(set(names) - {"T6"}) for names in named]) < 0.08
    none = [odd_ones(drawn(rng, [0.4] * 8))[0] for _ in range(200)]
    assert np.mean([bool(names) for names in none]) < 0.08
    names, rest = odd_ones(drawn(rng, np.linspace(0.3, 0.5, 8)))
    assert names == ()
    assert rest is None


def test_the_gain_of_one_cell_cancels_and_that_of_several_does_not():
    rng = np.random.default_rng(9)
    off = drawn(rng, [0.4, 0.41], gain=0.05, gain_std=0.01)
    here = difference(*comparable(off))
    assert here.relative == pytest.approx(0.025, abs=0.01)
    assert here.differ
    other = [off[0], replace(off[1], calibration="another cell {}")]
    assert not share_calibration(other)
    assert not share_calibration([replace(group, calibration="") for group in off])
    apart = difference(*comparable(other))
    assert not apart.differ
    assert apart.std == pytest.approx(0.01 * np.hypot(off[0].mean[0], off[1].mean[0]), rel=0.1)
    assert apart.dof > 100


def test_pairs_hold_for_all_pairs_at_once():
    rng = np.random.default_rng(10)
    wrong = [any(d.differ for d in pairs(drawn(rng, [0.4] * 4))) for _ in range(150)]
    assert np.mean(wrong) < 0.11
    found = pairs(drawn(rng, [0.4, 0.4, 0.4, 0.44]))
    assert len(found) == 6
    assert {d.second for d in found if d.differ} == {"T4"}
    with_T4 = next(d for d in found if (d.first, d.second) == ("T1", "T4"))
    assert with_T4.low < 0.04 < with_T4.high
    assert with_T4.relative_low < 0.1 < with_T4.relative_high
    assert with_T4.high - with_T4.low > difference(*drawn(rng, [0.4, 0.44])).std * 4


def test_a_change_is_seen_as_often_as_promised_and_hardly_ever_where_there_is_none():
    rng = np.random.default_rng(11)
    std = float(np.hypot(0.001, 0.001))
    least = smallest_change(std, 2 * DOF)
    seen, false, covered = [], [], []
    for _ in range(500):
        for shift, out in ((least, seen), (0.0, false)):
            old, new = drawn(rng, [0.4])[0], drawn(rng, [0.4 + shift])[0]
            (change,) = changes([(old, new)])
            out.append(change.changed)
            covered.append(change.difference.low <= shift <= change.difference.high)
    assert np.mean(seen) == pytest.approx(0.8, abs=0.06)
    assert np.mean(false) == pytest.approx(ALPHA, abs=0.03)
    assert np.mean(covered) == pytest.approx(0.95, abs=0.02)


def test_many_changes_asked_together_raise_no_more_false_alarms():
    rng = np.random.default_rng(12)
    alarms = []
    for _ in range(120):
        both = zip(drawn(rng, [0.4] * 8), drawn(rng, [0.4] * 8), strict=True)
        alarms.append(any(c.changed for c in changes(list(both))))
    assert np.mean(alarms) < 0.09
    assert holm([]) == []
    assert holm([0.02, 0.01]) == [0.02, 0.02]


def test_smallest_change_grows_with_few_degrees_of_freedom():
    least = [smallest_change(1.0, dof) for dof in (3.0, 10.0, 100.0, MANY)]
    assert least == sorted(least, reverse=True)
    assert least[-1] == pytest.approx(2.80, abs=0.01)
    assert smallest_change(0.0, 5.0) == 0.0
    assert np.isnan(smallest_change(float("nan"), 5.0))


def test_exact_data_and_a_coefficient_near_zero_make_no_trouble():
    exact = Group("a", ("C",), np.array([0.0]), np.array([[1e-6]]), np.inf)
    found = difference(exact, replace(exact, name="b"))
    assert np.isnan(found.relative)
    assert (found.relative_low, found.relative_high) == (-np.inf, np.inf)
    assert found.p_value == pytest.approx(1.0)
    assert homogeneity([exact, exact]).p_value == pytest.approx(1.0)
    with pytest.raises(ValueError, match="two or more"):
        homogeneity([exact])


def test_what_changes_between_recordings_is_found_and_counted():
    rng = np.random.default_rng(13)
    found = []
    for _ in range(25):
        thrusters = [drawn(rng, 0.4 * (1 + rng.normal(0, 0.01, 4))) for _ in range(4)]
        found.append(repeatability(thrusters))
    assert np.median([f.std for f in found]) == pytest.approx(0.01, rel=0.2)
    assert found[0].dof == 12
    assert "counted in every comparison" in found[0].statement
    quiet = [repeatability([drawn(rng, [0.4] * 4) for _ in range(4)]) for _ in range(50)]
    assert np.mean([f.p_value < ALPHA for f in quiet]) < 0.1
    assert "agree" in next(f for f in quiet if f.p_value > ALPHA).statement
    assert repeatability([drawn(rng, [0.4])]) is None
    group = replace(drawn(rng, [0.4])[0], recordings=4)
    wider = with_repeatability(group, found[0])
    assert wider.cov[0, 0] == pytest.approx(group.cov[0, 0] + (0.4 * found[0].std) ** 2 / 4, rel=0.02)
    assert with_repeatability(group, None) is group
    mad = repeatability([drawn(rng, [0.001, 10.0, -7.0])])
    assert mad.std == 1.0
