"""Levels to a campaign file: what is written is what is read back."""

from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from rig.campaign.config import WatchConfig
from rig.campaign.loading import load_campaign
from rig.campaign.plan_file import Level, template_of, write_campaign, write_sine
from rig.campaign.waits import CoolDown
from rig.errors import ConfigError, PlanError
from rig.operate.check import check_campaign

RIGHT = Path(__file__).parents[1] / "wrong" / "right.toml"


@dataclass
class Foreign:
    """Any object with these three will do."""

    voltage: float
    duration: float
    flow_speed: float | None = None


@pytest.fixture
def template():
    return template_of(load_campaign(RIGHT))


def test_written_levels_come_back(template, tmp_path):
    levels = [Level(10.0, 3.0), Foreign(-10.0, 4.5), Level(0.0, 2.0)]
    (path,) = write_campaign(levels, template, tmp_path / "plan.toml", ["why:\nbecause"])
    assert path.read_text().startswith("# why:\n# because\n[campaign]")
    found = load_campaign(path)
    holds = [(s.voltage, s.min_duration, s.max_duration) for s in found.plan if s.phase == "hold"]
    assert holds == [(10.0, 3.0, 3.0), (-10.0, 4.5, 4.5), (0.0, 2.0, 2.0)]
    again = load_campaign(RIGHT)
    assert (found.bench.path, found.output, found.thrusters) == (again.bench.path, again.output, again.thrusters)
    assert (found.tare, found.expected_C, found.plan.slew) == (again.tare, again.expected_C, again.plan.slew)
    assert check_campaign(path).peak_voltage == 10.0
    assert [file.name for file in tmp_path.iterdir()] == ["plan.toml"]


def test_each_stretch_of_one_flow_speed_is_a_file(template, tmp_path):
    levels = [Level(10.0, 3.0, 0.0), Level(-10.0, 3.0, 0.0), Level(10.0, 3.0, 0.5)]
    files = write_campaign(levels, template, tmp_path / "plan.toml")
    assert [file.name for file in files] == ["plan-1.toml", "plan-2.toml"]
    assert [load_campaign(file).flow_speed for file in files] == [0.0, 0.5]


def test_a_text_with_quotes_survives(template, tmp_path):
    odd = 'a "b" \\ c\nd \x7f é'
    (path,) = write_campaign([Level(1.0, 2.0)], replace(template, notes=odd, unattended=True), tmp_path / "p.toml")
    assert load_campaign(path).notes == odd
    assert load_campaign(path).unattended


def test_what_the_campaign_is_watched_with_stays(template, tmp_path):
    twin = tmp_path / "twins" / 'T1 "new".toml'
    twin.parent.mkdir()
    twin.touch()
    watch = WatchConfig(0.2, str(twin.with_name('{thruster} "new".toml')), stop=True)
    (path,) = write_campaign([Level(1.0, 2.0)], replace(template, watch=watch), tmp_path / "p.toml")
    assert load_campaign(path).watch == watch
    (path,) = write_campaign([Level(1.0, 2.0)], replace(template, watch=WatchConfig(off=True)), tmp_path / "p.toml")
    assert load_campaign(path).watch == WatchConfig(off=True)


def test_the_waits_stay(template, tmp_path):
    cool = CoolDown("motor_thermal.motor_temperature", 50.0, 600.0, "ask")
    waiting = replace(template, settle_water=60.0, settle_reversal=20.0, cool_down=cool)
    (path,) = write_campaign([Level(1.0, 2.0)], waiting, tmp_path / "p.toml")
    plan = load_campaign(path).plan
    assert (plan.settle_water, plan.settle_reversal, plan.cool_down) == (60.0, 20.0, cool)
    assert template_of(load_campaign(path)).cool_down == cool


def test_a_sine(template, tmp_path):
    found = load_campaign(write_sine(5.0, 0.25, 3, template, tmp_path / "sine.toml"))
    (wave,) = (s for s in found.plan if s.phase == "sine")
    assert (wave.amplitude, wave.frequency, wave.max_duration) == (5.0, 0.25, 12.0)


@pytest.mark.parametrize(
    ("levels", "text"),
    [
        ([], "there are no levels to write"),
        ([Level(float("nan"), 1.0)], "a level must be a finite number in V, but one is nan"),
        ([Level(5.0, 0.0)], "the duration of the level at 5 V must be a number above 0 s"),
        ([Level(5.0, 2.0, float("inf"))], "a flow speed must be a finite number"),
        ([Level(5.0, 0.1)], "shorter"),
    ],
)
def test_levels_that_cannot_be_run_leave_the_old_file(template, tmp_path, levels, text):
    path = tmp_path / "plan.toml"
    path.write_text("old")
    with pytest.raises(PlanError, match=text):
        write_campaign(levels, template, path)
    assert path.read_text() == "old"
    assert len(list(tmp_path.iterdir())) == 1


def test_no_such_folder(template, tmp_path):
    with pytest.raises(ConfigError, match="can't be written"):
        write_campaign([Level(5.0, 2.0)], template, tmp_path / "none" / "plan.toml")
