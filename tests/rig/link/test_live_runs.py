"""Which runs go on: a process that has ended is none, whoever its parent and whatever has its number now."""

import json
import os
import subprocess
import sys
from dataclasses import asdict

import pytest

from rig.errors import LinkError
from rig.link.live_runs import Run, find_run, live_runs, lock_bench, register
from rig.link.processes import alive, holders, started


@pytest.fixture
def private(tmp_path, monkeypatch):
    """A place for the files of live runs that no other test looks at."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return tmp_path


@pytest.fixture
def child():
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    yield process
    process.kill()
    process.communicate()


def run_of(pid, folder, **changes):
    return Run(pid, "socket", str(folder), "campaign", "bench", **changes)


def test_a_process_that_runs_is_a_live_run(private, child):
    register(run_of(child.pid, private))
    assert [run.pid for run in live_runs()] == [child.pid]
    assert find_run(private).started == started(child.pid) != ""


def test_a_zombie_is_no_live_run(private, child):
    register(run_of(child.pid, private))
    child.kill()
    os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)  # it has ended, and is not waited for
    os.kill(child.pid, 0)
    assert not alive(child.pid)
    assert live_runs() == []
    with pytest.raises(LinkError, match="no run is going on"):
        find_run(private)


def test_another_process_with_the_number_of_a_run_is_none(private, child):
    path = register(run_of(child.pid, private, started="another boot 4711"))
    assert live_runs() == []
    assert not path.exists(), "its file is removed"


def test_file_of_an_earlier_version_and_one_that_is_damaged(private, child):
    path = register(run_of(child.pid, private))
    facts = asdict(run_of(child.pid, private))
    del facts["started"]
    path.write_text(json.dumps(facts))
    assert [run.pid for run in live_runs()] == [child.pid]
    for text in ("", "{}", "[]", json.dumps(facts | {"pid": "4"}), json.dumps(facts | {"colour": 4})):
        path.write_text(text)
        assert live_runs() == []


def test_who_has_a_file_open(tmp_path):
    path = tmp_path / "T1.h5"
    path.write_text("rows")
    assert holders(path) == []
    with path.open() as file:
        holding = subprocess.Popen(
            [sys.executable, "-c", "input()"], stdin=subprocess.PIPE, pass_fds=(file.fileno(),), close_fds=True
        )
        assert holders(path) == [holding.pid], "and not this process itself"
        holding.communicate(b"\n")
    assert holders(path) == []


def test_a_bench_is_held_by_one(private):
    with lock_bench(private / "bench.toml"), pytest.raises(LinkError, match=f"in use by process {os.getpid()}"):
        lock_bench(private / "bench.toml")
    lock_bench(private / "bench.toml").close()
