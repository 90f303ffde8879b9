"""One run of a campaign in virtual time: the controller's stages, the drivers and the recorder, all in this process.

Whoever calls owns the time and the far ends of the wires. What is recorded went through the codecs of the drivers, the
control loop, the messages between the processes and the writer of the file, as in a run at a bench.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

from drivers.ports.wire import Wire
from rig.campaign.bench import Bench, build
from rig.campaign.config import CampaignConfig
from rig.campaign.loading import load_campaign
from rig.control.clocks import Clock
from rig.errors import LinkError
from rig.link.clients import Clients
from rig.link.front_end_messages import Request, RequestKind
from rig.link.sockets import Peer, listen, pair, socket_path
from rig.recording.ledger import Fact, Ledger
from rig.recording.line_writer import LineWriter
from rig.recording.recorder import Recorder
from rig.recording.recorder_link import RecorderLink
from rig.stages.campaign import LOG_NAME, SOCKET_NAME, run
from rig.stages.recording_header import Stamp
from rig.stages.session import Session, begin


class World(Clock, Protocol):
    """A bench in virtual time: its clock, and a wire for each device and bus by the names of the bench file."""

    @property
    def wires(self) -> Mapping[str, Wire]: ...


def record(campaign_path: Path, folder: Path, world: World, stamp: tuple[str, str]) -> tuple[Path, int]:
    """The recording of a campaign's one thruster, in the new `folder`, and ns of its t = 0 on the world's clock.

    `stamp`: id and date of the recording. Nobody attends: it is started when its checks have passed, and the thruster
    is there when it is asked for. Raises RigError for a campaign that can't be run or a run that did not complete.
    """
    campaign = replace(load_campaign(campaign_path), unattended=True)
    bench = build(campaign.bench, world.wires)
    folder.mkdir(parents=True)
    ours, theirs = pair("recorder")
    recorder = Recorder(Peer(theirs, "controller"), world.now_ns)
    clock = RecordingClock(world, recorder)
    session = assembled(campaign, folder, bench, RecorderLink(ours, None), clock)
    session.stamp = lambda: Stamp(*stamp)
    clock.session = session
    try:
        run(session)
    finally:
        recorder.turn()  # the link has ended: whatever is open is closed
        theirs.close()
    if session.status.outcome != "completed":
        raise LinkError(f"{campaign_path}: the run ended {session.status.outcome}: {session.status.cause}")
    return Path(session.status.files[-1]), clock.began_ns


def assembled(
    campaign: CampaignConfig,
    folder: Path,
    bench: Bench,
    recorder: RecorderLink,
    clock: Clock,
    before: tuple[Fact, ...] = (),
    thrusters: tuple[str, ...] = (),
) -> Session:
    """The session of a campaign on a bench and a clock that are given; nobody watches, nothing is opened yet.

    `thrusters`: those that are to be measured; none: all of the campaign.
    """
    with ExitStack() as undo:
        log = LineWriter((folder / LOG_NAME).open("ab"), sync=False)
        undo.callback(log.close)
        clients = Clients(listen(socket_path(folder, SOCKET_NAME)))
        undo.callback(clients.close)
        parts = (bench, recorder, Ledger.open(folder, at_once=True), log, clients, clock)
        session = begin(campaign, folder, thrusters, parts, before)
        undo.pop_all()
    return session


@dataclass
class RecordingClock:
    """The world's clock; while the loop sleeps the recorder has its turn, and what an operator is asked is answered."""

    world: Clock
    recorder: Recorder
    session: Session | None = None
    answered: set[str] = field(default_factory=set)
    began_ns: int = 0
    """t = 0 of the last recording."""

    def now_ns(self) -> int:
        return self.world.now_ns()

    def sleep_until_ns(self, t_ns: int) -> None:
        self.recorder.turn()
        self._answer()
        self.world.sleep_until_ns(t_ns)

    def _answer(self) -> None:
        if self.session is None:
            return
        state, checks = self.session.status.state, self.session.status.checks
        self.began_ns = self.session.loop.recording_since_ns or self.began_ns
        failed = [f"{check.name}: {check.text}" for check in checks if check.verdict == "failed"]
        if state == "preflight" and failed:
            self._say("stop", "the preflight: " + "; ".join(failed))
        elif state == "preflight" and all(check.verdict in ("passed", "warning") for check in checks):
            self._say("start")
        elif state == "mount":
            self._say("mounted")

    def _say(self, kind: RequestKind, text: str = "") -> None:
        """Once."""
        if self.session is not None and kind not in self.answered:
            self.answered.add(kind)
            self.session.loop.signals.append(Request(kind, text))
