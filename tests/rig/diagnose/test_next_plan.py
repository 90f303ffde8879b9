"""The next experiment as a campaign: what is written is what `rig check` accepts, and what is refused."""

import json
from dataclasses import replace
from math import inf
from pathlib import Path

import pytest

from identification.mismatch.diagnosis import (
    Adequate,
    Ambiguous,
    Diagnosis,
    HeldOutRmse,
    NextExperiment,
    PlanStep,
    Rmse,
)
from identification.recording import Recording
from rig.campaign.loading import load_campaign
from rig.cli import main
from rig.diagnose.command import tell
from rig.diagnose.next_plan import asked, limits_of, write_next
from rig.diagnose.outputs import Wanted
from rig.errors import ConfigError, PlanError
from rig.operate.check import check_campaign

RIGHT = Path(__file__).parents[1] / "wrong" / "right.toml"
STEPS = (PlanStep(0.0, 3.0), PlanStep(15.0, 1.0), PlanStep(-15.0, 4.0), PlanStep(0.0, 3.0))
NEXT = NextExperiment("separates exponent from linear_term", STEPS, 0.96)
FOUND = Diagnosis(
    *(("a",), "T1", Ambiguous((), NEXT), "C V|V|", {}, (), (), {}),
    *(Rmse(1.0, 0.1), HeldOutRmse(1.0, 0.1, 0.1, "blocks"), 1.0, 0.5),
)


def wanting(experiment):
    return replace(FOUND, answer=Ambiguous((), experiment))


@pytest.fixture
def campaign():
    return load_campaign(RIGHT)


def test_the_sweep_is_a_campaign_that_rig_check_accepts(campaign, tmp_path):
    (file,) = write_next(FOUND, campaign, tmp_path / "next.toml")
    found = load_campaign(file)
    holds = [(s.voltage, s.min_duration) for s in found.plan if s.phase == "hold"]
    assert holds == [(s.command_voltage, s.duration) for s in STEPS]
    assert check_campaign(file).peak_voltage == 15.0
    assert found.thrusters == ("T1",)
    assert "# separates exponent from linear_term" in file.read_text()


def test_the_sweep_keeps_the_waits_before_tares_and_none_inside(campaign, tmp_path):
    waits = replace(campaign, plan=replace(campaign.plan, settle_water=30.0, settle_reversal=20.0))
    (file,) = write_next(FOUND, waits, tmp_path / "next.toml")
    assert [s.doing for s in load_campaign(file).plan if s.doing in ("wait", "hold", "tare")] == (
        ["wait", "tare", *["hold"] * 4, "wait", "tare"]
    )


def test_one_file_for_each_flow_speed(campaign, tmp_path):
    moving = NextExperiment("w", (*STEPS, PlanStep(0.0, 3.0, 0.5), PlanStep(10.0, 3.0, 0.5)), 0.9)
    files = write_next(wanting(moving), campaign, tmp_path / "next.toml")
    assert [load_campaign(file).flow_speed for file in files] == [0.0, 0.5]
    of_before = replace(campaign, path=tmp_path / "next-1.toml")
    with pytest.raises(ConfigError, match=r"next-1.toml: this is the campaign that the plan is made from"):
        write_next(wanting(moving), of_before, tmp_path / "next.toml")


def test_refusals(campaign, tmp_path):
    assert write_next(wanting(None), campaign, tmp_path / "next.toml") == ()
    turning = wanting(replace(NEXT, quantity="rotation_rate"))
    with pytest.raises(ConfigError, match="levels of the next experiment are in rev/s; a campaign is driven in V"):
        write_next(turning, campaign, tmp_path / "next.toml")
    with pytest.raises(ConfigError, match="recordings are of thruster T9"):
        write_next(replace(FOUND, thruster="T9"), campaign, tmp_path / "next.toml")
    with pytest.raises(ConfigError, match="choose another name"):
        write_next(FOUND, campaign, campaign.path)
    with pytest.raises(ConfigError, match="choose another name"):
        asked(RIGHT, RIGHT)
    with pytest.raises(ConfigError, match="--plan needs --campaign"):
        asked(tmp_path / "next.toml", None)
    with pytest.raises(PlanError, match="--budget must be above 0 s"):
        limits_of(None, 0.0)
    assert not list(tmp_path.iterdir())


def test_limits_are_the_benchs(campaign):
    found = limits_of(asked(None, RIGHT), 120.0)
    assert (found.budget, found.slew, found.max_thrust) == (120.0, 12.0, 300.0)
    open_ended = replace(campaign, bench=replace(campaign.bench, limits=()))
    assert limits_of(open_ended).max_thrust is None
    cell = campaign.bench.devices["load_cell"]
    weaker = replace(cell, options=replace(cell.options, range_min=-150.0, range_max=500.0))
    bench = replace(campaign.bench, devices={**campaign.bench.devices, "load_cell": weaker})
    assert limits_of(replace(campaign, bench=bench)).max_thrust == 150.0
    assert limits_of(None).budget < inf


def test_a_plan_without_a_campaign_is_refused_before_anything_is_read(tmp_path, capsys):
    with pytest.raises(SystemExit) as left:
        main(["diagnose", str(tmp_path / "none.h5"), "--plan", str(tmp_path / "next.toml")])
    assert left.value.code == 2
    assert "--plan needs --campaign" in capsys.readouterr().err


UNWRITABLE = {
    "no folder": (("--plan", "absent/next.toml"), "there is no folder"),
    "a folder": (("--json", "."), "this is a folder"),
    "no folder for a twin": (("--save-twin", "absent/T1.json"), "there is no folder"),
    "the campaign itself": (("--plan", str(RIGHT)), "choose another name for --plan"),
    "no budget": (("--budget", "0"), "--budget must be above 0 s"),
}


@pytest.mark.parametrize("command", ["diagnose", "compare"])
@pytest.mark.parametrize("name", UNWRITABLE)
def test_what_cannot_be_written_is_refused_before_anything_is_read(name, command, tmp_path, capsys):
    (option, value), says = UNWRITABLE[name]
    files = [str(tmp_path / "none.h5")] * (2 if command == "compare" else 1)
    given = value if option == "--budget" else str(tmp_path / value)
    with pytest.raises(SystemExit) as left:
        main([command, *files, "--campaign", str(RIGHT), option, given])
    assert left.value.code == 2
    said = capsys.readouterr().err
    assert said.startswith(f"rig {command}: ")
    assert says in said
    assert said.count("\n") == 1


def test_a_campaign_of_other_thrusters_is_refused_before_anything_is_computed(campaign, tmp_path):
    other = Recording("a", "T9", ())
    with pytest.raises(ConfigError, match="recordings are of thruster T9"):
        Wanted(plan=tmp_path / "next.toml", campaign=campaign).refuse([other])
    Wanted(campaign=campaign).refuse([other])


def test_no_next_experiment_is_an_answer(campaign, tmp_path, capsys):
    plan = tmp_path / "next.toml"
    tell(replace(FOUND, answer=Adequate()), Wanted(plan=plan, campaign=campaign))
    said = capsys.readouterr()
    assert said.err == f"no next experiment is needed, for no finding has a rival; {plan} was not written\n"
    assert "T1: adequate" in said.out
    assert not plan.exists()
    tell(FOUND, Wanted(json_path=Path("-"), plan=plan, campaign=campaign))
    said = capsys.readouterr()
    assert json.loads(said.out)["next_experiment"]["why"] == NEXT.why
    assert f"next experiment written to {plan}" in said.err
    assert plan.exists()
