"""Control charts: who is outside, which stretch is off and since when, and what a calibration shares."""

import numpy as np
import pytest

from identification.control_charts.charts import chart, limit_for
from identification.control_charts.spread import unit_spread

UNITS, SPREAD, OWN, GAIN = 2000, 0.006, 0.001, 0.002
LIMIT = limit_for(UNITS, 2)


def production(seed):
    """(value, scatter of each, calibration, its stated error)."""
    rng = np.random.default_rng(seed)
    group = np.arange(UNITS) // 250
    value = 0.4 + SPREAD * rng.standard_normal(UNITS) + GAIN * rng.standard_normal(8)[group]
    value += OWN * rng.standard_normal(UNITS)
    return value, np.full(UNITS, OWN), group.astype(float), np.full(UNITS, GAIN)


def drawn(value, *rest, **how):
    return chart(value, *rest, LIMIT, **how)


def test_a_sound_production_shows_nothing_in_nineteen_of_twenty():
    alarms = [bool(c.outside.any() or c.stretches) for c in (drawn(*production(seed)) for seed in range(60))]
    assert sum(alarms) <= 8


def test_one_odd_unit_is_outside_and_is_no_stretch():
    value, *rest = production(1)
    value[700] += 0.05
    found = drawn(value, *rest)
    assert np.flatnonzero(found.outside).tolist() == [700]
    assert found.stretches == ()
    assert found.deviation[700] == pytest.approx(0.05 / np.hypot(SPREAD, OWN), rel=0.3)


def test_a_drift_is_a_stretch_with_its_beginning_and_end():
    value, *rest = production(2)
    value[1200:1400] -= 0.012
    (stretch,) = drawn(value, *rest).stretches
    assert abs(stretch.first - 1200) < 25
    assert abs(stretch.last - 1399) < 25
    assert stretch.size == pytest.approx(-2.0, rel=0.15)


def test_what_units_of_a_calibration_share_is_taken_out_as_far_as_it_states():
    value, std, group, stated = production(3)
    value += np.where(group == 4, 0.004, 0.0)
    alike = drawn(value, std, group, stated)
    assert not alike.stretches
    shared = next(each for each in alike.shared if each.group == 4)
    assert abs(shared.removed) <= 2 * GAIN + 1e-12
    value += np.where(group == 4, 0.02, 0.0)
    beyond = drawn(value, std, group, stated)
    assert [s for s in beyond.stretches if abs(s.first - 1000) < 25 and abs(s.last - 1249) < 25]
    assert next(each for each in beyond.shared if each.group == 4).beyond


def test_only_above_where_only_that_is_bad():
    value, *rest = production(4)
    value[[300, 900]] += [0.05, -0.05]
    assert np.flatnonzero(drawn(value, *rest, side="high").outside).tolist() == [300]


def test_the_spread_is_told_by_neighbours_beyond_the_measurement():
    value, std, group, _ = production(5)
    assert unit_spread(value, std, group) == pytest.approx(SPREAD, rel=0.12)
    value[1000:] += 1.0
    value[::97] += 0.3
    assert unit_spread(value, std, group) == pytest.approx(SPREAD, rel=0.12)
    assert unit_spread(value, np.full(UNITS, 1.0), group) == 0.0
    assert np.isnan(unit_spread(value[:1], std[:1], group[:1]))


def test_two_units_are_no_chart():
    with pytest.raises(ValueError, match="three units"):
        chart(np.ones(2), np.ones(2), np.zeros(2), np.zeros(2), 3.0)
