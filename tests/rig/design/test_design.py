"""rig design: the plan it writes keeps its limits, promises what the fit will know, and says what is impossible."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification.experiment_design.run_order import Course, Slow, schedule
from identification.experiment_design.thrust_design import Noise, Terms
from rig.campaign.loading import load_campaign
from rig.campaign.plan import Plan, TareConfig
from rig.campaign.plan_file import Template
from rig.campaign.shapes import Interleaved
from rig.cli import main
from rig.design.ask import Options, prepare
from rig.design.baselines import judge, means_of, plain_plans
from rig.design.command import design, plan_of
from rig.design.noise import read_noise
from rig.design.optimal_levels import THOROUGH, Ask, mean_heat
from rig.design.plan import choose, without_checks
from rig.design.text import budget, design_json, design_text, lack_of_fit_dof, table
from rig.errors import PlanError, RecordingError
from rig.operate.check import check_campaign

RIGHT = Path(__file__).parents[1] / "wrong" / "right.toml"
BENCH = Path(__file__).parents[1] / "wrong" / "right_bench.toml"
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


FIT = {
    "format": "thruster-rig-fit",
    "version": 1,
    "fits": [
        {
            "thruster": name,
            "parameters": {"C": {"value": C, "unit": "N/V^2"}},
            "tare": {"a": {"value": 1.0}},
            "excess_std": None,
            "points": [
                {"std_error": 0.1, "t_start": 0.0, "t_end": 4.0, "thrust": 1.0 + C * V * V} for V in (0.0, 10.0, 20.0)
            ]
            + [{"std_error": None, "t_start": 0.0, "t_end": 4.0, "thrust": 0.0}],
        }
        for name, C in (("T1", 0.4), ("T2", 0.5))
    ],
}


def test_noise_of_a_fit(tmp_path):
    path = tmp_path / "fit.json"
    path.write_text(json.dumps(FIT))
    found = read_noise(str(path), ("T2",))
    assert (found.noise.white, found.C) == (pytest.approx(0.2), 0.5)
    both = read_noise(str(path), ("T9",)).C
    assert both == pytest.approx(0.45)
    assert read_noise("0.3", ()).noise == Noise(0.3)


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ("{", "not JSON"),
        ("[]", "no fits in it"),
        ('{"format": "thruster-rig-fit", "fits": []}', "no fits in it"),
        ('{"format": "thruster-rig-fit", "fits": [{"points": []}]}', "no points with standard errors"),
    ],
)
def test_noise_that_is_no_fit(tmp_path, content, text):
    path = tmp_path / "fit.json"
    path.write_text(content)
    with pytest.raises(RecordingError, match=text):
        read_noise(str(path), ())


def test_the_command_writes_a_campaign_that_may_run(tmp_path, capsys):
    plan, out, fit = tmp_path / "plan.toml", tmp_path / "design.json", tmp_path / "fit.json"
    fit.write_text(json.dumps(FIT))
    arguments = ["--time", "4min", "--noise", str(fit), "--continuous", "15", "-o", str(plan), "--json", str(out)]
    assert main(["design", str(RIGHT), *arguments]) == 0
    said = capsys.readouterr().out
    assert "as efficient" in said
    assert "rig check" in said
    report = check_campaign(plan)
    content = json.loads(out.read_text())
    assert report.run.expected == pytest.approx(content["total"], abs=0.05)
    assert report.run.expected <= 240.0
    assert content["mean_heat"] <= (15 / 20) ** 4
    assert report.campaign.expected_C == 0.4


def test_a_bench_alone_will_do(tmp_path, capsys):
    plan = tmp_path / "plan.toml"
    options = ["--time", "120", "--thruster", "T7", "--slew", "10", "--levels", "5,10,-5,-10", "-o", str(plan)]
    assert main(["design", "--bench", str(BENCH), *options, "--json", "-"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert any("1 N in a mean over one second" in text for text in content["remarks"])
    campaign = load_campaign(plan)
    assert campaign.prove_watchdog
    assert check_campaign(plan).run.expected == pytest.approx(content["total"], abs=0.05)
    assert campaign.thrusters == ("T7",)
    assert {abs(s.voltage) for s in campaign.plan if s.phase == "hold"} <= {5.0, 10.0}


def test_thrust_limits_the_levels(capsys):
    assert main(["design", str(RIGHT), "--time", "3min", "--max-thrust", "40", "--json", "-"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert max(abs(level["voltage"]) for level in content["levels"]) == pytest.approx(10.0)
    assert any("limits the levels" in text for text in content["remarks"])
    limited = ["--max-thrust", "40", "--levels", "-20,-8,8,20"]
    assert main(["design", str(RIGHT), "--time", "3min", *limited, "--json", "-"]) == 0
    assert {abs(level["voltage"]) for level in json.loads(capsys.readouterr().out)["levels"]} == {8.0}


CALLS = [
    (["--time", "0"], "--time must be a number above 0 s, but is 0"),
    (["--time", "nan"], "--time must be a number above 0 s, but is nan"),
    (["--time", "soon"], "--time must be a time such as 600, 10min or 1h"),
    ([], "--time is missing"),
    (["--time", "1"], "the watchdog proof alone takes"),
    (["--time", "60", "--levels", "10"], "only one level is (10 V) allowed"),
    (["--time", "60", "--levels", "nan"], "--levels must be finite numbers"),
    (["--time", "60", "--levels", "five"], "--levels must be voltages such as"),
    (["--time", "60", "--levels", "30,-30"], "at most 20 V are allowed"),
    (["--time", "60", "--max-voltage", "nan"], "--max-voltage must be a number above 0 V, but is nan"),
    (["--time", "60", "--max-voltage", "99"], "--max-voltage is 99 V, but"),
    (["--time", "60", "--heat", "0"], "--heat must be a number above 0"),
    (["--time", "60", "--heat", "0.1", "--continuous", "5"], "give one of them"),
    (["--time", "60", "--noise", "nan"], "--noise must be a number above 0"),
    (["--time", "60", "--noise", "none.json"], "neither a number nor a file"),
    (["--time", "60", "--slew", "1000"], "--slew is 1000 V/s"),
    (["--time", "60", "--check-levels", "-1"], "--check-levels must be a number of at least 0"),
    (["--time", "60", "--mass", "5"], "--mass goes with --inertia only"),
    (["--time", "3min", "-o", str(RIGHT)], "choose another name for -o"),
    (["--time", "3min", "--json", "/nowhere/x.json"], "can't be written"),
    (["--inertia", "--heat", "0.5"], "--heat does not go with --inertia"),
    (["--inertia"], "--mass is missing"),
    (["--inertia", "--mass", "5"], "--k is missing"),
    (["--inertia", "--mass", "nan", "--k", "1"], "--mass must be a number above 0 kg"),
    (["--inertia", "--mass", "5", "--k", "1", "--f0", "nan"], "--f0 must be a finite number"),
    (["--inertia", "--mass", "5", "--k", "1", "--max-travel", "0"], "--max-travel must be a number above 0"),
]


@pytest.mark.parametrize(("arguments", "text"), CALLS, ids=lambda value: " ".join(value) if value else "none")
def test_bad_input_is_one_sentence_and_status_2(arguments, text, capsys):
    assert main(["design", str(RIGHT), *arguments]) == 2
    said = capsys.readouterr().err
    assert text in said
    assert said.count("\n") == 1


INERTIA = ["--inertia", "--mass", "500", "--k", "170", "--rate", "3", "--sigma", "0.07", "--time", "60"]


def test_a_place_is_needed(capsys):
    assert main(["design", "--time", "60"]) == 2
    assert "either a campaign" in capsys.readouterr().err
    assert main(["design", *INERTIA, "--max-force", "60", "-o", "x.toml"]) == 2
    assert "-o needs a campaign" in capsys.readouterr().err
    assert main(["design", "--bench", str(BENCH), "--time", "60", "--dead-band", "1"]) == 2
    assert "a thrust is needed" in capsys.readouterr().err


def test_inertia_as_text_and_as_a_plan_of_volts(tmp_path, capsys):
    assert main(["design", *INERTIA, "--max-force", "60", "--max-travel", "6"]) == 0
    assert "standard error" in capsys.readouterr().out
    plan = tmp_path / "sine.toml"
    arguments = [*INERTIA, "--max-force", "500", "--per-volt", "0.8", "-o", str(plan), "--json", "-"]
    assert main(["design", str(RIGHT), *arguments]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["amplitude"] == pytest.approx(0.8 * content["voltage"] ** 2)
    (wave,) = (step for step in load_campaign(plan).plan if step.phase == "sine")
    assert wave.amplitude == pytest.approx(content["voltage"])
    assert wave.max_duration <= 60.0


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--max-force", "60", "-o", "x.toml"], "give --per-volt"),
        (["--max-force", "60", "--f0", "70"], "leaves nothing of 60 N"),
        (["--max-force", "60", "--rate", "0.05"], "fewer than 5 positions"),
    ],
)
def test_inertia_that_cannot_be(arguments, text, capsys):
    assert main(["design", str(RIGHT), *INERTIA, *arguments]) == 2
    assert text in capsys.readouterr().err


def test_a_sine_too_steep_for_the_bench(tmp_path, capsys):
    light = ["--inertia", "--mass", "0.5", "--k", "1", "--rate", "50", "--sigma", "0.01", "--time", "10"]
    plan = str(tmp_path / "x.toml")
    arguments = [*light, "--max-force", "100", "--max-travel", "12", "--per-volt", "0.25", "-o", plan]
    assert main(["design", str(RIGHT), *arguments]) == 2
    assert "V/s, but the bench allows" in capsys.readouterr().err


def test_the_command_searches_the_order_thoroughly():
    options = Options(time="3min", campaign=RIGHT, noise="0.01", max_thrust=150.0, seed=3)
    found = prepare(options)
    assert (found.ask.tries, found.ask.seed, found.ask.only_these) == (THOROUGH, 3, False)
    made = design(found.ask, found.template)
    assert made.judged.exposure.drift < 0.3 * min(plain.exposure.drift for plain in made.plain)
