"""`--scheduler`: the same rows from the workers of a Dask cluster; one of them is killed, and nothing is lost."""

import os
import re
import signal
import subprocess
import sys

import pyarrow.dataset
import pytest
from click.testing import CliRunner
from distributed import Client

from rig.fit.command import fit_command
from rig.fleet import dask_cluster
from rig.fleet.question import Question
from tests.rig.fleet.small_recordings import folder

ENVIRONMENT = os.environ | {"DASK_DISTRIBUTED__WORKER__DAEMON": "false", "OMP_NUM_THREADS": "1"}


def rig_fit(*arguments):
    return CliRunner().invoke(fit_command, [str(each) for each in arguments], catch_exceptions=False)


def started(*command):
    return subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_" + command[0], *command[1:]],
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
        start_new_session=True,
    )


def heard(process, pattern):
    for line in process.stderr:
        if found := re.search(pattern, line):
            return found
    raise AssertionError(f"{process.args} ended without {pattern}")


@pytest.fixture
def cluster(tmp_path):
    """(address, workers): a scheduler and two workers, each a process of its own."""
    scheduler = started("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
    workers = []
    try:
        address = heard(scheduler, r"Scheduler at:\s+(tcp://127.0.0.1:\d+)")[1]
        for number in range(2):
            local = (
                "--nthreads",
                "1",
                "--no-dashboard",
                "--no-nanny",
                "--local-directory",
                str(tmp_path / f"w{number}"),
            )
            workers.append(started("worker", address, "--host", "127.0.0.1", *local))
        for worker in workers:
            heard(worker, "Starting established connection|Registered to")
        yield address, workers
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()
            process.stderr.close()


def table(store):
    rows = pyarrow.dataset.dataset(str(store / "fits"), partitioning="hive").to_table().to_pylist()
    return {row["recording_id"]: row for row in rows}


def test_the_rows_of_a_cluster_are_those_of_this_machine_also_when_a_worker_is_killed(cluster, tmp_path, monkeypatch):
    address, workers = cluster
    root = folder(tmp_path / "line", 24)
    (root / "torn.h5").write_bytes((root / "0.h5").read_bytes()[:3000])
    monkeypatch.setattr(dask_cluster, "_answer", kills_at(5, workers[0], dask_cluster._answer))
    told = rig_fit(root, "--scheduler", address, "--store", tmp_path / "there")
    assert kinds(address) == ["fits"], "workers remember each kind of task: files must not be kinds"
    assert (told.exit_code, "25 files, 25 computed, 0 known, 1 can't be used" in told.output) == (1, True), told.output
    assert rig_fit(root, "--jobs", 1, "--store", tmp_path / "here").exit_code == 1
    here, there = table(tmp_path / "here"), table(tmp_path / "there")
    assert there == here
    assert workers[0].poll() == -signal.SIGKILL
    again = rig_fit(root, "--scheduler", "tcp://127.0.0.1:1", "--store", tmp_path / "there")
    assert "0 computed, 25 known" in again.output, "nobody is asked for what is known"


def kinds(address):
    """Of tasks, that a cluster has heard of."""
    with Client(address, set_as_default=False) as client:
        return client.run_on_scheduler(lambda dask_scheduler: list(dask_scheduler.task_prefixes))


def kills_at(number, worker, answer):
    """The answer as it is; with the so-many-th the worker dies."""
    asked = []

    def told(future, order):
        asked.append(order)
        if len(asked) == number:
            worker.kill()
            worker.wait()
        return answer(future, order)

    return told


def test_no_scheduler_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr(dask_cluster, "PATIENCE", 0.5)
    told = rig_fit(folder(tmp_path / "line", 1), "--scheduler", "tcp://127.0.0.1:1", "--store", tmp_path / "store")
    assert told.exit_code == 2
    assert "--scheduler tcp://127.0.0.1:1: no scheduler of Dask answers there" in told.output


def test_a_worker_with_other_sources_is_refused(tmp_path):
    root = folder(tmp_path / "line", 1)
    question = Question("fits", "rig.fit.row:answer", {}, "another")
    with pytest.raises(Exception, match=r"a worker runs other sources .* than the one that asks \(another\)"):
        dask_cluster.ask(str(root / "0.h5"), question)


@pytest.mark.parametrize("beside", [("--jobs", 2), ("--limit", 5)])
def test_what_is_said_where_workers_are_started_is_refused(beside, tmp_path):
    told = rig_fit(folder(tmp_path / "line", 1), "--scheduler", "tcp://127.0.0.1:1", *beside)
    assert (told.exit_code, "not with --scheduler" in told.output) == (2, True)
