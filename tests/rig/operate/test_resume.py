"""rig resume: what is left to do, and what is refused."""

import io
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.campaign.config import MountConfig
from rig.cli import main
from rig.errors import ConfigError, RecordingError, RigError
from rig.hdf5.write import RecordingFile
from rig.link.live_runs import Run, live_runs, register
from rig.link.recorder_messages import ChannelSpec, Rows, StepRow, StreamSpec
from rig.operate.measured import Measured
from rig.operate.resume import keep, remainder, require_unchanged, told
from rig.operate.run import require_mountable
from rig.recording.ledger import Ledger, file_facts, kept_steps, read
from tests.rig.virtual_bench import bench_config, campaign_config


def begun(folder, *thrusters):
    campaign = campaign_config(folder, bench_config(folder), thrusters=thrusters)
    return campaign, {
        "fact": "start",
        "campaign": "c",
        "identities": {},
        "thrusters": list(thrusters),
        **file_facts(campaign),
    }


def ended(thruster, outcome, sha256=""):
    facts = {"fact": "run_end", "thruster": thruster, "outcome": outcome, "cause": "", "sha256": sha256}
    return {**facts, "recording": f"{thruster}.h5", "time_to_zero_s": None}


def run_of(thruster, folder, attempt=1, name="", recording_id=None):
    path = folder / (name or f"{thruster}.h5")
    run = {"fact": "run_start", "thruster": thruster, "recording": str(path), "recording_t0_ns": 0, "attempt": attempt}
    return run if recording_id is None else {**run, "recording_id": recording_id}


def recorded(folder, config, upto, thruster="T1", name="", lose=0.0):
    """The file of a run that was cut after the plan's first `upto` steps; its samples end `lose` s before them."""
    path, now, rows = folder / (name or f"{thruster}.h5"), 0.0, []
    for step in list(config.plan)[:upto]:
        rows.append(StepRow(step.index, step.phase, step.voltage, now, now + step.min_duration))
        now += step.min_duration
    attributes = {"recording_id": f"id of {path.name}", "thruster": thruster, "campaign_toml": config.text}
    channel = ChannelSpec("thrust", "thrust", "N")
    file = RecordingFile(path, attributes, (StreamSpec("load_cell", "virtual", (channel,)),), 0)
    t_ns = np.arange(0, round((now - lose) * 1e9), 10_000_000, dtype=np.int64)
    file.add_rows(Rows(0, t_ns, np.sin(t_ns * 1e-9).reshape(-1, 1)))
    for row in rows:
        file.add_step(row)
    file.close("aborted", "a test", now)
    return path


def test_goes_on_at_the_first_step_that_is_not_measured(tmp_path):
    config, start = begun(tmp_path, "T1", "T2", "T3")
    recorded(tmp_path, config, 8, "T1")
    recorded(tmp_path, config, 3, "T2")
    facts = [start, run_of("T1", tmp_path), ended("T1", "completed"), run_of("T2", tmp_path), ended("T2", "tripped")]
    rest = remainder(facts, tmp_path, config)
    assert (rest.finished, rest.thrusters) == (("T1",), ("T2", "T3"))
    assert rest.begun == {"T2": Measured(("T2.h5",), frozenset({0, 1, 2}), "id of T2.h5")}
    assert told(rest, config) == "finished: T1; to do: T2 from step 4 (ramp) on, T3"
    keep(rest, tmp_path)
    kept = kept_steps(read(tmp_path), "T2")
    assert (kept["steps"], kept["recordings"], kept["continues"]) == ([0, 1, 2], ["T2.h5"], "id of T2.h5")


def test_what_several_parts_hold_is_put_together(tmp_path):
    config, start = begun(tmp_path, "T1")
    recorded(tmp_path, config, 3, name="T1.h5")
    recorded(tmp_path, config, 5, name="T1-2.h5")
    facts = [start, run_of("T1", tmp_path), run_of("T1", tmp_path, 2, "T1-2.h5"), {"fact": "resume", **start}]
    found = remainder(facts, tmp_path, config).begun["T1"]
    assert (found.recordings, found.steps) == (("T1.h5", "T1-2.h5"), frozenset(range(5)))


def test_run_of_which_every_step_is_measured_is_finished(tmp_path):
    """It was killed while it closed."""
    config, start = begun(tmp_path, "T1", "T2")
    recorded(tmp_path, config, len(list(config.plan)))
    rest = remainder([start, run_of("T1", tmp_path)], tmp_path, config)
    assert (rest.finished, rest.thrusters) == (("T1",), ("T2",))


def test_run_that_has_a_tare_alone_is_repeated(tmp_path):
    config, start = begun(tmp_path, "T1")
    recorded(tmp_path, config, 1)
    rest = remainder([start, run_of("T1", tmp_path)], tmp_path, config)
    assert (rest.begun, rest.thrusters) == ({}, ("T1",))


def test_step_whose_samples_are_lost_is_not_measured(tmp_path):
    config, start = begun(tmp_path, "T1")
    recorded(tmp_path, config, 5, lose=0.3)
    assert remainder([start, run_of("T1", tmp_path)], tmp_path, config).begun["T1"].steps == frozenset(range(4))


def test_file_that_is_not_there_is_told_with_the_lines_that_name_it(tmp_path):
    config, start = begun(tmp_path, "T1", "T2")
    facts = [start, run_of("T1", tmp_path), ended("T1", "completed")]
    with pytest.raises(RecordingError, match=r"names T1\.h5, which is not there; put it back; .*name it \(2, 3\)"):
        remainder(facts, tmp_path, config)


def test_folder_that_was_moved(tmp_path):
    config, start = begun(tmp_path, "T1")
    recorded(tmp_path, config, 3)
    facts = [start, run_of("T1", Path("/another/disk"))]
    assert remainder(facts, tmp_path, config).begun["T1"].recordings == ("T1.h5",)


def test_another_file_under_the_name_is_told(tmp_path):
    config, start = begun(tmp_path, "T1")
    path = recorded(tmp_path, config, 3)
    with pytest.raises(RecordingError, match=r"its recording_id is 'id of T1\.h5', expected 'another'"):
        remainder([start, run_of("T1", tmp_path, recording_id="another")], tmp_path, config)
    with pytest.raises(
        RecordingError, match=r"T1\.h5 is not what was closed: its SHA-256 is not that of campaign.jsonl:3"
    ):
        remainder([start, run_of("T1", tmp_path), ended("T1", "aborted", "0" * 64)], tmp_path, config)
    with pytest.raises(RecordingError, match="its campaign_toml is"):
        remainder([{**start, "campaign_toml": "[campaign] # other"}, run_of("T1", tmp_path)], tmp_path, config)
    path.write_bytes(b"no recording")
    with pytest.raises(
        RecordingError, match=r"is not an HDF5 file.*take the lines out of campaign\.jsonl that name it \(2\)"
    ):
        remainder([start, run_of("T1", tmp_path)], tmp_path, config)


def test_thruster_that_is_not_in_the_campaign_is_told(tmp_path):
    config, start = begun(tmp_path, "T1")
    for facts in ([{**start, "thrusters": ["T1", "T9"]}], [start, run_of("../T9", tmp_path)]):
        with pytest.raises(RecordingError, match=r"names the thruster '(\.\./)?T9', which is not in .*edited"):
            remainder(facts, tmp_path, config)


def test_nothing_to_resume(tmp_path):
    config, start = begun(tmp_path, "T1")
    recorded(tmp_path, config, 8)
    with pytest.raises(RecordingError, match="nothing to resume"):
        remainder([start, run_of("T1", tmp_path), ended("T1", "completed")], tmp_path, config)
    with pytest.raises(RecordingError, match="never started"):
        remainder([], tmp_path, config)


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
