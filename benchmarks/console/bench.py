"""A simulated bench, a controller whose run begins again after each stop, and its truth log, read as it grows."""

from __future__ import annotations

import json
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rig.link.live_runs import Run
from rig.operate.run import listening
from tests.reliability.live import LiveBench, attach, live_bench

CAMPAIGN = """
[campaign]
name = "stop key"
bench = "bench.toml"
thrusters = ["T1"]
output = "out"
unattended = true
expected_C = 0.5
prove_watchdog = false

[tare]
duration = 0.3
max_std_error = 5.0
max_drift = 100.0

[plan]
kind = "levels"
voltages = [6.0]
slew = 24.0
zero_every = 1
[plan.dwell]
kind = "fixed"
duration = 60.0

[overrides]
"campaign.prove_watchdog" = "a benchmark of something else"
"""
CONTROLLER = Path(__file__).with_name("begins_again.py")


@dataclass
class Truth:
    """The bench's log of what the motor really did, line after line."""

    path: Path
    at: int = 0
    left: bytes = b""
    command: float = 0.0
    """Of the newest change that was read: the duty cycle, 0 after a release."""
    since_ns: int = 0
    """When it came."""
    changes: list[tuple[int, float]] = field(default_factory=list)

    def read(self) -> list[dict[str, Any]]:
        """What has been written since."""
        with self.path.open("rb") as file:
            file.seek(self.at)
            data = file.read()
        self.at += len(data)
        *lines, self.left = (self.left + data).split(b"\n")
        found = [json.loads(line) for line in lines]
        for line in found:
            if line["event"] in ("command", "timeout"):
                value = float(line.get("value") or 0.0) if line["event"] == "command" else 0.0
                if value != self.command:
                    self.command, self.since_ns = value, line["t_ns"]
                    self.changes.append((line["t_ns"], value))
        return found

    def until_driven(self, seconds: float = 0.15, timeout: float = 20.0) -> None:
        """Wait until the drive has had the same command, which is not 0, for so long: a hold, and no ramp."""
        self._until(
            lambda: self.command != 0.0 and time.monotonic_ns() - self.since_ns > seconds * 1e9,
            f"a hold of {seconds:g} s",
            timeout,
        )

    def zero_after(self, t_ns: int, timeout: float = 2.0) -> float | None:
        """s from `t_ns` to the first command of 0, or to the release by the drive's own watchdog. None where it was 0
        by then: a trip of the guard came before, and the log was behind."""

        def first() -> int | None:
            return next((t - t_ns for t, value in self.changes[-50:] if t >= t_ns and value == 0), None)

        self._until(lambda: first() is not None or not self._driven(t_ns), f"command 0 after {t_ns}", timeout)
        found = first()
        return found * 1e-9 if found is not None and self._driven(t_ns) else None

    def sent_after(self, t_ns: int) -> float:
        """s from `t_ns` to the first 0 that the controller handed to the motor's driver."""
        zeros = self.path.parents[1] / "out" / "zeros"

        def first() -> int | None:  # the log may be ahead of who writes this line
            lines = zeros.read_text().split("\n")[:-1] if zeros.exists() else []
            return next((sent - t_ns for sent in map(int, lines) if sent >= t_ns), None)

        self._until(lambda: first() is not None, "the line of the 0 that was sent", 2.0)
        found = first()
        assert found is not None
        return found * 1e-9

    def _driven(self, t_ns: int) -> bool:
        return [value for t, value in self.changes if t < t_ns][-1] != 0.0

    def _until(self, reached: Any, what: str, timeout: float) -> None:
        deadline = time.monotonic() + timeout
        self.read()
        while not reached():
            if time.monotonic() > deadline:
                said = (self.path.parents[1] / "out" / "controller.out").read_text(errors="replace")[-1000:]
                raise TimeoutError(f"{what} was waited for {timeout:g} s; {self.changes[-4:]}; the controller: {said}")
            select.select([], [], [], 0.02)
            self.read()


@contextmanager
def running(folder: Path) -> Iterator[tuple[Run, Truth, LiveBench]]:
    """The motor turns, and does again soon after each stop."""
    with live_bench(folder) as bench:
        (folder / "campaign.toml").write_text(CAMPAIGN)
        out = folder / "out"
        out.mkdir()
        with (out / "controller.out").open("wb") as log:
            process = subprocess.Popen(
                [sys.executable, str(CONTROLLER), str(folder / "campaign.toml"), str(out)],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True,
            )  # fmt: skip
        try:
            run = listening(process, out)
            front = attach(run)
            front.begin(lambda s: s.state == "hold", timeout=90.0)
            front.peer.close()
            yield run, Truth(folder / "ports" / "truth.jsonl"), bench
        finally:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(20.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
