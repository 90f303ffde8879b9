"""The plan that is designed keeps its limits, promises what the fit will know, and says what is impossible."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification.experiment_design.run_order import Course, Slow, schedule
from identification.experiment_design.thrust_design import Noise, Terms
from rig.campaign.plan import Plan, TareConfig
from rig.campaign.plan_file import Template
from rig.campaign.shapes import Interleaved
from rig.design.baselines import judge, means_of, plain_plans
from rig.design.command import design, plan_of
from rig.design.optimal_levels import Ask, mean_heat
from rig.design.plan import choose, without_checks
from rig.design.text import budget, design_json, design_text, lack_of_fit_dof, table
from rig.errors import PlanError

COURSE = Course(12.0, 4, 1.0, 3.0, 0.8)


GRID = np.linspace(-20.0, 20.0, 21)


ASK = Ask(Terms(0.4), Noise(0.05, 0.001), GRID, 180.0, COURSE, slow=Slow(0.05), tries=100)


TEMPLATE = Template("", Path(), ("T1",), Path(), 12.0, TareConfig(), 0.8)


@pytest.fixture(scope="module")
def designed():
    return design(ASK, TEMPLATE)


def test_the_plan_fills_the_time_and_keeps_its_dwells(designed):
    chosen = designed.chosen
    assert 0.95 * ASK.total < designed.judged.total <= ASK.total
    assert chosen.dwells.max() <= ASK.max_dwell
    assert chosen.dwells.min() >= COURSE.settle + ASK.least_mean - 0.05
    assert designed.plan.peak() == 20.0
    assert sum(budget(tuple(designed.plan), 0.0).values()) == pytest.approx(designed.judged.total)


def test_what_is_promised_is_what_the_plan_gives(designed):
    means, total = means_of(designed.plan)
    planned, time = schedule(designed.chosen.levels, designed.chosen.dwells, COURSE)
    assert total == pytest.approx(time)
    for found, expected in ((means.voltage, planned.voltage), (means.seconds, planned.seconds), (means.at, planned.at)):
        assert found == pytest.approx(expected)
    assert designed.judged.promise.std == pytest.approx(designed.chosen.promise.std)


def test_most_time_goes_to_both_ends_and_some_to_check_levels(designed):
    rows = table(designed)
    ends = [row for row in rows if not row.check]
    assert [row.voltage for row in ends] == [-20.0, 20.0]
    assert len([row for row in rows if row.check]) == 4
    assert all(0 < row.notices < 1 for row in rows)
    assert lack_of_fit_dof(designed) == 5


def test_it_beats_the_plain_plans_and_their_drift(designed):
    assert [plain.name for plain in designed.plain] == ["staircase", "interleaved"]
    for plain in designed.plain:
        assert plain.total == pytest.approx(ASK.total, abs=0.1)
        assert designed.judged.value < 0.7 * plain.value
        assert abs(designed.judged.exposure.per_drift[0]) < 0.3 * abs(plain.exposure.per_drift[0])


def test_check_levels_cost_what_is_said(designed):
    unchecked = without_checks(ASK)
    assert unchecked is not None
    assert set(np.abs(unchecked.levels)) == {20.0}
    assert 0.5 < unchecked.value / designed.judged.value < 1.0
    none = design(replace(ASK, check_levels=0), TEMPLATE)
    assert "no check levels: only 1 degree(s) of freedom say" in design_text(none)
    assert none.unchecked is None


def test_no_freedom_is_said():
    one_side = replace(ASK, candidates=np.array([-20.0, 20.0]), only_these=True, terms=Terms(0.4, two_sided=True))
    assert "nothing can say" in design_text(design(one_side, TEMPLATE))


@pytest.mark.parametrize("limit", [0.3, 0.1])
def test_heat_is_kept(limit):
    found = choose(replace(ASK, max_heat=limit))
    assert 0.8 * limit < mean_heat(found.levels, found.dwells, COURSE, 20.0) <= limit


def test_a_heat_that_cannot_be_kept():
    with pytest.raises(PlanError, match=r"the mean heat cannot be kept below|every level heats more"):
        choose(replace(ASK, max_heat=1e-4, candidates=np.array([-20.0, -18.0, 18.0, 20.0]), only_these=True))


@pytest.mark.parametrize(
    ("terms", "criterion"),
    [(Terms(0.4, True), "D"), (Terms(0.4, linear=True), "A"), (Terms(0.4, dead_band=1.0), "D")],
)
def test_other_models_have_other_levels(terms, criterion):
    found = design(replace(ASK, terms=terms, criterion=criterion, total=120.0), TEMPLATE)
    assert np.all(np.isfinite(found.judged.promise.std))
    inner = [r for r in table(found) if not r.check and abs(r.voltage) < 20.0]
    assert inner
    assert min(found.judged.value / plain.value for plain in found.plain) < 1.05


def test_a_hold_that_does_not_repeat_gets_more_and_shorter_holds():
    stable, shaky = (choose(replace(ASK, noise=Noise(0.05, 0.0, floor))) for floor in (0.0, 0.2))
    assert shaky.levels.size > 1.5 * stable.levels.size


def test_one_direction_only():
    found = design(replace(ASK, candidates=GRID[GRID >= 0]), TEMPLATE)
    assert found.chosen.levels.min() >= 0
    assert [plain.name for plain in found.plain] == ["staircase"]


def test_a_plain_plan_that_tells_nothing_is_left_out():
    ask = replace(ASK, candidates=GRID[GRID <= 0], terms=Terms(0.4, True))
    assert judge("half", Plan(Interleaved(5.0, 1), plan_of(choose(ASK), TEMPLATE).dwell, 12.0), ask) is not None
    assert plain_plans(ask, TareConfig()) == ()
    assert plain_plans(replace(ASK, total=20.0), TareConfig()) == ()


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"candidates": np.array([10.0]), "only_these": True}, r"only one level is \(10 V\) allowed"),
        ({"candidates": np.array([0.0])}, "no level but 0 V is allowed"),
        ({"total": 20.0}, "20 s are too short"),
        ({"total": 4.0}, "4 s are too short"),
        ({"max_dwell": 0.9}, "leave no measurement"),
        ({"candidates": GRID[GRID > 0], "terms": Terms(0.4, True)}, "C_minus"),
    ],
)
def test_the_impossible_is_refused(change, text):
    with pytest.raises(PlanError, match=text):
        choose(replace(ASK, **change))


def test_json_is_finite(designed):
    content = json.loads(json.dumps(design_json(designed), allow_nan=False))
    assert content["parameters"]["C"]["std"] == pytest.approx(designed.judged.promise.std[0])
    assert len(content["sequence"]) == designed.chosen.levels.size
