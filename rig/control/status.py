"""What the controller shows: the facts of the campaign so far, turned into a Snapshot ten times a second."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Literal

from rig.campaign.config import CampaignConfig
from rig.link.front_end_messages import (
    Check,
    Device,
    LogLine,
    Point,
    Progress,
    Reading,
    Snapshot,
    State,
    TracedChannel,
    Watching,
)
from rig.sequence.ticks import Output, settings_for

LOG_LINES = 500
"""Newest log lines that travel with every snapshot."""


@dataclass(frozen=True, slots=True)
class Held:
    """A step of the plan that was measured; times in s of the recording."""

    index: int
    voltage: float
    begin: float
    end: float


@dataclass
class Status:
    """Grows during the campaign; `snapshot` freezes it."""

    campaign: CampaignConfig
    thrusters: tuple[str, ...]
    state: State = "connecting"
    run: int = 0
    checks: list[Check] = field(default_factory=list)
    points: list[Point] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    log: deque[LogLine] = field(default_factory=lambda: deque(maxlen=LOG_LINES))
    log_count: int = 0
    outcome: Literal["", "running", "completed", "aborted", "tripped"] = ""
    cause: str = ""
    stop_confirmed: bool | None = None
    watch: Watching = field(default_factory=Watching)
    """Of this thruster's run, as the watcher last said."""
    held: list[Held] = field(default_factory=list)
    """What was measured of this run, in order."""
    watchdog_measured: float | None = None
    """s from the last command to rest, in the newest proof of the motor's own watchdog."""
    started: float | None = None
    """s, when the operator started the campaign."""
    output: Output | None = None
    """Of the running sequencer."""
    paused_for: float = 0.0
    """s of the campaign, in pauses of an operator: neither gone nor to come."""
    begun: float = 0.0
    """s, when the controller began."""
    sequence: int = 0
    run_expected: float = field(init=False)
    """s of one run by plan, the proof at its rest included; reckoned once, a long plan has thousands of steps."""
    proof_expected: float = field(init=False)
    """s of one proof of the watchdog; the first run of a campaign has one more."""

    def __post_init__(self) -> None:
        proof = settings_for(self.campaign, "").proof
        self.proof_expected = proof.expected if proof else 0.0
        self.run_expected = self.campaign.plan.duration().expected + self.proof_expected

    def take(self, output: Output) -> None:
        """What a run's tick has decided; `output` None before its first one."""
        self.paused_for += output.paused_for - (self.output.paused_for if self.output else 0.0)
        self.output, self.state = output, output.state
        if output.time_to_zero_s is not None:
            self.watchdog_measured = output.time_to_zero_s

    @property
    def thruster(self) -> str:
        return self.thrusters[min(self.run, len(self.thrusters) - 1)]

    def say(self, line: LogLine) -> None:
        self.log.append(line)
        self.log_count += 1

    def snapshot(
        self,
        now: float,
        time: float,
        command: float,
        readings: tuple[Reading, ...],
        devices: tuple[Device, ...] = (),
        channels: tuple[TracedChannel, ...] = (),
    ) -> Snapshot:
        """`now` s monotonic, `time` s since the start of the recording, `command` V."""
        self.sequence += 1
        return Snapshot(
            seq=self.sequence,
            campaign=self.campaign.name,
            state=self.state,
            thruster=self.thruster,
            command=command,
            time=time,
            readings=readings,
            checks=tuple(self.checks),
            points=tuple(self.points),
            log=tuple(self.log),
            log_count=self.log_count,
            trace=(),
            progress=self._progress(now),
            files=tuple(self.files),
            outcome=self.outcome,
            cause=self.cause,
            stop_confirmed=self.stop_confirmed,
            attended=not self.campaign.unattended,
            since_begin=now - self.begun,
            mounted_by_hand=not self.campaign.bench.mount.command,
            watch=self.watch,
            reason=self.output.reason if self.output else "",
            state_elapsed=self.output.state_elapsed if self.output else 0.0,
            devices=devices,
            channels=channels,
        )

    def _progress(self, now: float) -> Progress | None:
        if self.started is None:
            return None
        out = self.output
        elapsed = now - self.started - self.paused_for
        left = len(self.thrusters) - self.run - (1 if out else 0)
        first = self.proof_expected if self.run == 0 else 0.0
        eta = (out.remaining if out else first) + max(left, 0) * self.run_expected
        if self.state == "done":
            eta = 0.0
        return Progress(
            step=out.step if out else 0,
            steps=out.steps if out else 0,
            step_elapsed=out.step_elapsed if out else 0.0,
            step_expected=out.step_expected if out else 0.0,
            run=self.run,
            runs=len(self.thrusters),
            elapsed=elapsed,
            eta=eta,
            fraction=elapsed / (elapsed + eta) if elapsed + eta > 0 else 0.0,
        )
