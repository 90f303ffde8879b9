"""One campaign on an open bench: preflight, then mount and measure each thruster; ends with the motor at rest.

Stages run one after another; each is a loop of ticks. Whatever happens, the last thing done to the motor is 0 V and
release.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from rig.campaign.bench import build
from rig.campaign.config import CampaignConfig
from rig.control.clocks import MonotonicClock, host_clocks
from rig.control.loop import IDLE
from rig.control.machine_load import busy
from rig.errors import RigError
from rig.link.clients import Clients
from rig.link.sockets import listen, socket_path
from rig.recording.ledger import FILE_NAME, Ledger, read, recordings_before
from rig.recording.line_writer import LineWriter
from rig.recording.recorder_link import RecorderLink
from rig.stages.arming import preflight
from rig.stages.measuring import measure
from rig.stages.mounting import mount
from rig.stages.session import Session, Stopped, begin
from rig.watch.watch_link import WatchLink

SOCKET_NAME = "controller.sock"
LOG_NAME = "controller.log"
FAREWELL = 1.0
"""s that the final snapshot is shown to front ends before the process ends."""


def open_session(campaign: CampaignConfig, folder: Path, thrusters: tuple[str, ...]) -> Session:
    """The session of the controller process: its recorder started, its socket there, no device open yet."""
    before = tuple(read(folder)) if (folder / FILE_NAME).exists() else ()
    clients = Clients(listen(socket_path(folder, SOCKET_NAME)))
    with (folder / "recorder.log").open("ab") as log:
        recorder = RecorderLink.start(log)
    watch = _watcher(folder) if not campaign.watch.off else None
    ledger = Ledger.open(folder)
    own_log = LineWriter((folder / LOG_NAME).open("ab"), sync=False)
    parts = (build(campaign.bench), recorder, ledger, own_log, clients, MonotonicClock())
    session = begin(campaign, folder, thrusters, parts, before, watch)
    session.loop.host, session.loop.busy = host_clocks, busy
    session.status.files.extend(recordings_before(before, folder))
    return session


def _watcher(folder: Path) -> WatchLink:
    with (folder / "watcher.log").open("ab") as log:
        return WatchLink.start(log)


def run(session: Session) -> None:
    """The whole campaign; never raises what belongs to bench or operator. Motor at rest, all closed, always."""
    status = session.status
    try:
        try:
            stages(session)
            status.outcome, status.cause = "completed", ""
        except Stopped as stop:
            conclude(session, stop.outcome, str(stop))
        except RigError as error:
            conclude(session, "aborted", str(error))
        session.rest()
        farewell(session)
    finally:
        try:
            if status.outcome in ("", "running"):
                status.outcome, status.cause = "aborted", "the controller failed; its log says where"
                session.rest()
        finally:
            session.close()


def stages(session: Session) -> None:
    """Raises Stopped or RigError for everything that ends a campaign early."""
    preflight(session)
    for index in range(len(session.status.thrusters)):
        session.status.run = index
        mount(session)
        measure(session)


def conclude(session: Session, outcome: Literal["aborted", "tripped"], cause: str) -> None:
    """How the campaign ended; a run that said so itself has told more."""
    status = session.status
    if status.outcome in ("", "running"):
        status.outcome, status.cause = outcome, cause
        session.say("trip" if outcome == "tripped" else "warning", cause)


def farewell(session: Session) -> None:
    """Show the end to front ends that are there."""
    loop = session.loop
    session.status.state = "done"
    end = loop.now + FAREWELL
    while loop.now < end and loop.clients.connected:
        loop.tick(session.motor, lambda _: IDLE)
