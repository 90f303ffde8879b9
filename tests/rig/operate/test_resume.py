"""rig resume: what is left to do, and what is refused."""

import io
import os
from dataclasses import replace

import pytest

from rig.campaign.config import MountConfig
from rig.cli import main
from rig.errors import ConfigError, RecordingError, RigError
from rig.link.live_runs import Run, live_runs, register
from rig.operate.resume import remainder, require_unchanged
from rig.operate.run import require_mountable
from rig.recording.ledger import Ledger, file_facts
from tests.rig.virtual_bench import bench_config, campaign_config


def begun(folder, *thrusters):
    campaign = campaign_config(folder, bench_config(folder), thrusters=thrusters)
    return campaign, {"fact": "start", "thrusters": list(thrusters), **file_facts(campaign)}


def ended(thruster, outcome):
    return {"fact": "run_end", "thruster": thruster, "outcome": outcome, "recording": f"{thruster}.h5"}


def test_goes_on_at_the_first_that_is_not_finished(tmp_path):
    _, start = begun(tmp_path, "T1", "T2", "T3")
    rest = remainder([start, ended("T1", "completed"), ended("T2", "tripped")], tmp_path)
    assert (rest.finished, rest.thrusters) == (("T1",), ("T2", "T3"))
    assert rest.campaign == tmp_path / "campaign.toml"


def test_a_second_resume_believes_the_first_start(tmp_path):
    _, start = begun(tmp_path, "T1", "T2", "T3")
    facts = [start, ended("T1", "completed"), {"fact": "resume", "thrusters": ["T2", "T3"]}, ended("T2", "completed")]
    assert remainder(facts, tmp_path).thrusters == ("T3",)


def test_nothing_to_resume(tmp_path):
    _, start = begun(tmp_path, "T1")
    with pytest.raises(RecordingError, match="nothing to resume"):
        remainder([start, ended("T1", "completed")], tmp_path)
    with pytest.raises(RecordingError, match="never started"):
        remainder([], tmp_path)


def test_changed_files_are_refused_with_the_difference(tmp_path):
    campaign, start = begun(tmp_path, "T1")
    require_unchanged([start], campaign)
    with pytest.raises(ConfigError, match=r"(?s)campaign\.toml has changed.*-\[campaign\]\n\+\[campaign\] # louder"):
        require_unchanged([start], replace(campaign, text="[campaign] # louder"))
    other = replace(campaign.bench, text="[bench]\nslew = 99")
    with pytest.raises(ConfigError, match=r"(?s)bench\.toml has changed.*\+slew = 99"):
        require_unchanged([start], replace(campaign, bench=other))


def test_folder_without_a_campaign_and_a_run_that_is_going_on(tmp_path, capsys):
    assert main(["resume", str(tmp_path), "--headless"]) == 2
    assert "expected a campaign folder" in capsys.readouterr().err
    path = register(Run(os.getpid(), "s", str(tmp_path.resolve()), "c", "b"))
    try:
        assert any(run.folder == str(tmp_path.resolve()) for run in live_runs())
        assert main(["resume", str(tmp_path), "--headless"]) == 2
        assert "still going on" in capsys.readouterr().err
    finally:
        path.unlink()


def test_nobody_to_mount_the_next_thruster(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO())
    campaign, _ = begun(tmp_path, "T1", "T2")
    by_hand = replace(campaign, bench=replace(campaign.bench, mount=MountConfig()))
    with pytest.raises(RigError, match="2 thrusters, and nobody at this terminal"):
        require_mountable(by_hand, ["T1", "T2"], headless=True)
    require_mountable(by_hand, ["T2"], headless=True)
    require_mountable(by_hand, ["T1", "T2"], headless=False)


def test_ledger_of_a_start_can_be_read_back(tmp_path):
    campaign, start = begun(tmp_path, "T1")
    ledger = Ledger.open(tmp_path)
    ledger.write(**start)
    ledger.close()
    require_unchanged([start], campaign)
