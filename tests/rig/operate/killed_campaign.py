"""A campaign in virtual time in processes of its own, each killed with its recorder at an instant of its choosing.

    python -m tests.rig.operate.killed_campaign FOLDER

A line of standard input is one part: `SECONDS` of virtual time until kill -9, or `inf`. What `rig resume` does before
it starts a controller is done before each part but the first. The answer is how the part ended: `killed`, or its
outcome.
"""

from __future__ import annotations

import os
import signal
import sys
from dataclasses import dataclass
from pathlib import Path

from rig.campaign.bench import Bench
from rig.campaign.config import CampaignConfig, MountConfig
from rig.campaign.dwell import FixedDwell
from rig.campaign.plan import Plan, TareConfig
from rig.campaign.shapes import Interleaved
from rig.link.sockets import Peer, pair
from rig.operate.resume import keep, remainder
from rig.operate.virtual_time import RecordingClock, assembled
from rig.recording.ledger import FILE_NAME, Fact, read
from rig.recording.recorder import Recorder
from rig.recording.recorder_link import RecorderLink
from rig.stages.campaign import run
from tests.rig.virtual_bench import bench_config, campaign_config
from tests.rig.virtual_devices import Cell, Motor

THRUSTERS = ("T1", "T2", "T3")
TARE = TareConfig(0.4, 0.3, 3.0)
PLAN = Plan(Interleaved(8.0, 8), FixedDwell(0.5, 0.15), slew=60.0, rest=0.2, zero_every=4, tare=TARE)
"""45 steps."""
LONG = Plan(Interleaved(8.0, 20), FixedDwell(0.5, 0.15), slew=60.0, rest=0.2, zero_every=6, tare=TARE)
"""102 steps."""


@dataclass
class DeadlyClock:
    """Virtual time of a bench in memory; at `end` s it kills this process with its recorder."""

    motor: Motor
    cell: Cell
    end: float
    t_ns: int = 10**9

    def now_ns(self) -> int:
        return self.t_ns

    def sleep_until_ns(self, t_ns: int) -> None:
        while self.t_ns < t_ns:
            self.t_ns = min(self.t_ns + 2_000_000, t_ns)
            now = self.t_ns * 1e-9
            if now >= self.end:
                os.kill(os.getpid(), signal.SIGKILL)
            if self.t_ns % 20_000_000 == 0:
                self.motor.step(now, 0.02)
            if self.t_ns % 10_000_000 == 0:
                self.cell.step(now)


def config_in(folder: Path, plan: Plan = PLAN) -> CampaignConfig:
    bench = bench_config(folder, mount=MountConfig(("true",), 1e6))
    return campaign_config(folder, bench, thrusters=THRUSTERS, plan=plan, prove_watchdog=True)


def play(folder: Path, plan: Plan, seconds: float) -> str:
    """One part of the campaign, in this process: the outcome, unless it is killed."""
    config, before = config_in(folder, plan), tuple[Fact, ...]()
    thrusters = config.thrusters
    if (folder / FILE_NAME).exists() and any(fact["fact"] == "start" for fact in read(folder)):
        rest = remainder(read(folder), folder, config)
        keep(rest, folder)
        before, thrusters = tuple(read(folder)), rest.thrusters
    motor = Motor()
    cell = Cell(motor)
    ours, theirs = pair("recorder")
    clock_of_all = DeadlyClock(motor, cell, 1.0 + seconds)
    recorder = Recorder(Peer(theirs, "controller"), clock_of_all.now_ns)
    clock = RecordingClock(clock_of_all, recorder)
    bench = Bench(config.bench, {}, {"load_cell": cell, "motor": motor})
    session = assembled(config, folder, bench, RecorderLink(ours, None), clock, before, thrusters)
    clock.session = session
    run(session)
    recorder.turn()
    return session.status.outcome


def answer(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def main(folder: Path, plan: Plan = PLAN) -> None:
    for line in sys.stdin:
        child = os.fork()
        if not child:
            try:
                answer(play(folder, plan, float(line)))
            finally:
                os._exit(0)
        if os.WIFSIGNALED(os.waitpid(child, 0)[1]):
            answer("killed")


if __name__ == "__main__":
    main(Path(sys.argv[1]), LONG if len(sys.argv) > 2 else PLAN)
