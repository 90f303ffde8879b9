"""A loop that was stopped wakes up: its first frame is zero, wherever in its tick it was stopped.

Only a stop between the last look at the clock and the write itself can't be seen: there 0 V is the next frame, at once.
"""

from __future__ import annotations

import os
import random
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.reliability.live import PROJECT

WAKES = int(os.environ.get("THRUSTER_RIG_WAKES", "12"))
"""`THRUSTER_RIG_WAKES=200` tries as many as anybody likes, 0.8 s each."""
STOPPED = 0.5
"""s, longer than any lapse that is allowed."""

pytestmark = [pytest.mark.reliability, pytest.mark.timeout(60 + 2 * WAKES)]


class Frames:
    """The commands that the process says, one a line."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdout is not None
        self._fd, self._rest = process.stdout.fileno(), b""

    def next(self, patience: float) -> list[float]:
        """All that come until nothing more waits; none when nothing comes within `patience` s."""
        found: list[float] = []
        while select.select([self._fd], [], [], 0.0 if found else patience)[0]:
            *lines, self._rest = (self._rest + os.read(self._fd, 65536)).split(b"\n")
            found += [float(line) for line in lines]
            if not lines and not self._rest:
                break
        return found

    def until_driven(self, ticks: int) -> None:
        seen = 0
        while seen < ticks:
            frames = self.next(10.0)
            assert frames, "nothing was sent for 10 s"
            seen = seen + len(frames) if frames[-1] else 0


def is_stopped(pid: int) -> bool:
    return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "T"


def test_first_frame_after_every_wake_is_zero(tmp_path, report):
    chance, woken = random.Random(19), []
    command = [sys.executable, "-m", "tests.reliability.machine.waking", str(tmp_path), str(WAKES)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, cwd=PROJECT) as process:
        frames = Frames(process)
        try:
            for _ in range(WAKES):
                frames.until_driven(20)
                select.select([], [], [], chance.uniform(0.0, 0.02))
                os.kill(process.pid, signal.SIGSTOP)
                while not is_stopped(process.pid):
                    pass
                frames.next(0.0)  # what left before: a process that is stopped has written it
                assert frames.next(STOPPED) == []
                os.kill(process.pid, signal.SIGCONT)
                woken.append(frames.next(10.0))
        finally:
            process.kill()
    late = [volts for volts in woken if volts[0] != 0.0]
    report("wakes whose first frame was not zero", float(len(late)), f"of {WAKES}")
    assert len(woken) == WAKES
    assert len(late) <= 1 + WAKES // 100, "stopped within the write itself, some 20 us of the 20 ms of a tick"
    assert all(set(volts[1:]) <= {0.0} for volts in woken), "and then 0 V follows at once"
