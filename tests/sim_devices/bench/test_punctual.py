"""A bench goes before what else the machine does, and no longer where it cannot keep up."""

import os
import select
import signal
import time

import pytest

from sim_devices.bench.process import running
from tests.sim_devices.bench.test_bench import PATIENCE, WORLD

pytestmark = pytest.mark.alone  # a bench of its own process, in real time


def may_be_real_time() -> bool:
    child = os.fork()
    if not child:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
        except PermissionError:
            os._exit(1)
        os._exit(0)
    return os.waitpid(child, 0)[1] == 0


def scheduler(pid: int) -> int:
    return os.sched_getscheduler(pid) & ~os.SCHED_RESET_ON_FORK


def wait_for(pid: int, wanted: int) -> None:
    deadline = time.monotonic() + PATIENCE
    while scheduler(pid) != wanted:
        assert time.monotonic() < deadline, f"scheduler {scheduler(pid)}, not {wanted}"
        os.sched_yield()


def test_a_bench_goes_first_until_it_cannot_keep_up(tmp_path):
    if not may_be_real_time():
        pytest.skip("real-time scheduling is not permitted to this user")
    with running(WORLD, tmp_path / "ports", seed=1) as bench:
        pid = bench.process.pid
        wait_for(pid, os.SCHED_FIFO)
        os.kill(pid, signal.SIGSTOP)
        select.select([], [], [], 0.3)  # s, above what it takes for keeping up
        os.kill(pid, signal.SIGCONT)
        wait_for(pid, os.SCHED_OTHER)
