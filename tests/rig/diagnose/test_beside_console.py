"""The diagnosis that a console starts: what its process says, line by line, and how it ends."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from rig.campaign.loading import load_campaign
from rig.diagnose.beside_console import Progress, campaign_of
from rig.diagnose.next_from_answer import free_name
from rig.errors import ConfigError, RecordingError
from rig.recording.ledger import file_facts
from tests.rig.diagnose.diagnosed_files import ROOT

RIGHT = Path(__file__).parents[1] / "wrong" / "right.toml"


def start(*files: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "rig.diagnose.beside_console", *map(str, files)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT,
    )  # fmt: skip


def said(process: subprocess.Popen[str]) -> list[dict]:
    """All of it; its standard input stays open until it has ended."""
    assert process.stdout is not None
    lines = [json.loads(line) for line in process.stdout]
    process.communicate()
    return lines


def began_with(folder: Path, campaign: Path = RIGHT) -> None:
    """A ledger that says so."""
    files = file_facts(load_campaign(RIGHT)) | {"campaign_file": str(campaign)}
    fact = {"fact": "start", "campaign": "right", "thrusters": ["T1"], "identities": {}, **files}
    (folder / "campaign.jsonl").write_text(json.dumps(fact) + "\n")


def test_it_says_how_far_it_is_then_the_answer_with_the_files_names_and_the_campaign(dead, tmp_path):
    path, diagnosis, _, _ = dead
    began_with(tmp_path)
    shutil.copy(path, tmp_path / "T1.h5")
    process = start(tmp_path / "T1.h5")
    *before, last = said(process)
    assert process.returncode == 0
    assert all(set(each) == {"at"} for each in before)
    assert any("looking for effects" in each["at"] for each in before)
    assert last["answer"]["verdict"] == diagnosis["verdict"] == "explained"
    assert last["answer"]["recordings"] == ["T1.h5"]
    assert (last["campaign"], last["no_sweep"]) == (str(RIGHT.resolve()), "")


def test_without_a_ledger_it_answers_and_says_why_no_sweep_can_be_run(dead):
    last = said(start(dead[0]))[-1]
    assert last["answer"]["verdict"] == "explained"
    assert "campaign.jsonl" in last["no_sweep"]


def test_what_cannot_be_used_is_one_sentence(tmp_path):
    (tmp_path / "T1.h5").write_text("no recording")
    (only,) = said(start(tmp_path / "T1.h5"))
    assert "T1.h5" in only["fault"]


def test_an_interrupt_ends_the_search_with_what_it_has(dead):
    process = start(dead[0])
    assert process.stdout is not None
    while "looking" not in process.stdout.readline():
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    last = said(process)[-1]
    assert last["answer"]["verdict"]


def test_the_second_interrupt_ends_at_once_and_lines_come_no_faster_than_they_are_read():
    times = iter([0.0, 0.0, 0.05, 0.3, 0.3])
    lines: list[dict] = []
    progress = Progress(lines.append, lambda: next(times))
    with pytest.raises(SystemExit):
        Progress(lines.append).interrupt(2, None)  # there is no search to end
    progress.stage("looking")
    progress.trying("a")
    progress.trying("b")
    assert [line["at"] for line in lines] == ["0 s, looking", "0 s, looking: b"]
    progress.interrupt(2, None)
    with pytest.raises(SystemExit) as left:
        progress.interrupt(2, None)
    assert left.value.code == 130


def test_the_campaign_is_the_one_of_the_ledger(tmp_path):
    with pytest.raises(RecordingError, match="expected a campaign folder"):
        campaign_of(tmp_path / "T1.h5")
    began_with(tmp_path)
    assert campaign_of(tmp_path / "T1.h5").path == RIGHT
    (tmp_path / "campaign.jsonl").write_text("")
    with pytest.raises(ConfigError, match="does not say which campaign"):
        campaign_of(tmp_path / "T1.h5")
    began_with(tmp_path, tmp_path / "gone.toml")
    with pytest.raises(ConfigError, match=r"gone\.toml"):
        campaign_of(tmp_path / "T1.h5")


def test_no_file_of_an_earlier_sweep_is_in_the_way(tmp_path):
    assert free_name(tmp_path, "T1").name == "next-T1.toml"
    (tmp_path / "next-T1-1.toml").touch()  # of several flow speeds
    assert free_name(tmp_path, "T1").name == "next-T1.2.toml"
    (tmp_path / "next-T1.2.toml").touch()
    assert free_name(tmp_path, "T1").name == "next-T1.3.toml"
    assert free_name(tmp_path, "../T 9").name == "next-..-T-9.toml"
    assert free_name(tmp_path, "../T 9").parent == tmp_path
