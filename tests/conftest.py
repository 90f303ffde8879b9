"""Every test must leave nothing behind: no thread, no child process, no open file, port or socket file.

Linear algebra gets one thread in each process, as in rig/blind/workers.py: matrices here are small, a second thread
waits for the first and takes the processor from the other worker meanwhile (half of all time, measured).
"""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

pytest_plugins = ("tests.reliability.page.measured",)

settings.register_profile("busy machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("busy machine")

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # read once, when numpy is first imported

GRACE = 2.0
"""s that threads and processes get to end after the test."""


def _open_files() -> set[str]:
    """Targets of this process's descriptors that are files or devices; pipes, sockets and the like are left out."""
    targets = set()
    for link in Path("/proc/self/fd").iterdir():
        try:
            targets.add(str(link.readlink()))
        except OSError:
            continue
    return {target for target in targets if target.startswith("/") and not target.startswith(("/dev/null", "/proc/"))}


def _leftovers(threads: set[threading.Thread], files: set[str]) -> list[str]:
    left = [f"thread {t.name}" for t in threading.enumerate() if t not in threads and not t.daemon and t.is_alive()]
    left += [f"process {child.name} ({child.pid})" for child in multiprocessing.active_children()]
    return left + [f"open file {path}" for path in sorted(_open_files() - files)]


@pytest.fixture(autouse=True)
def no_leaks() -> Iterator[None]:
    """Fails the test that leaves a thread, a child process or an open file behind."""
    threads, files = set(threading.enumerate()), _open_files()
    yield
    deadline = time.monotonic() + GRACE
    pause = threading.Event()
    while (left := _leftovers(threads, files)) and time.monotonic() < deadline:
        pause.wait(0.01)
    assert not left, f"the test left behind: {', '.join(left)}"
