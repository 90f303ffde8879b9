"""rig design: noise from an earlier fit, the campaign it writes, inertia, and what it refuses."""

import json
from pathlib import Path

import pytest

from identification.experiment_design.thrust_design import Noise
from rig.campaign.loading import load_campaign
from rig.cli import main
from rig.design.ask import Options, prepare
from rig.design.command import design
from rig.design.noise import read_noise
from rig.design.optimal_levels import THOROUGH
from rig.errors import RecordingError
from rig.operate.check import check_campaign

RIGHT = Path(__file__).parents[1] / "wrong" / "right.toml"


BENCH = Path(__file__).parents[1] / "wrong" / "right_bench.toml"


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


def test_the_waits_of_a_campaign_take_of_the_time_there_is(tmp_path, capsys):
    waits = "slew = 12.0\nsettle_water = 8.0\nsettle_reversal = 20.0\nzero_every = 4"
    campaign = tmp_path / "waits.toml"
    bench = f'"{BENCH.resolve()}"'
    campaign.write_text(RIGHT.read_text().replace("slew = 12.0", waits).replace('"right_bench.toml"', bench))
    plan = tmp_path / "plan.toml"
    assert main(["design", str(campaign), "--time", "4min", "-o", str(plan)]) == 0
    assert "settle_water of the campaign is in each rest" in " ".join(capsys.readouterr().out.split())
    report = check_campaign(plan)
    assert 200.0 < report.run.expected <= 240.0
    found = report.campaign.plan
    assert (found.rest, found.settle_water, found.settle_reversal) == (9.0, 0.0, 0.0)


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
