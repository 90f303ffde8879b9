"""Main of the controller process: one campaign on one bench, alone on it, deaf to the terminal, stopped by any signal.

python -m rig.stages.controller CAMPAIGN FOLDER [THRUSTER ...]
"""

from __future__ import annotations

import gc
import logging
import os
import signal
import sys
from pathlib import Path

from rig.campaign.config import CampaignConfig
from rig.campaign.loading import load_campaign
from rig.errors import RigError
from rig.link.front_end_messages import Request
from rig.link.live_runs import Run, lock_bench, register
from rig.link.sockets import socket_path
from rig.stages.campaign import SOCKET_NAME, open_session, run
from rig.stages.session import Session
from rig.visible_text import visible


def main(campaign_path: str, folder_path: str, *thrusters: str) -> int:
    """Run the campaign; 0 once it has ended in order, however it went, 2 for a campaign that can't be begun."""
    folder = Path(folder_path)
    try:
        campaign = load_campaign(Path(campaign_path))
        _require_known(campaign, thrusters)
        with lock_bench(campaign.bench.path):
            session = open_session(campaign, folder, thrusters)
            stop_on_signals(session)
            session.say("info", real_time(), of_bench=True)
            socket = str(socket_path(folder, SOCKET_NAME))
            announcement = register(Run(os.getpid(), socket, str(folder), campaign.name, str(campaign.bench.path)))
            try:
                run(session)
            finally:
                announcement.unlink(missing_ok=True)
    except RigError as error:
        sys.stderr.write(visible(f"rig: {error}\n"))
        return 2
    return 0


def _require_known(campaign: CampaignConfig, thrusters: tuple[str, ...]) -> None:
    """What `rig resume` found in a ledger may have been edited: only the campaign's own thrusters are run."""
    for thruster in thrusters:
        if thruster not in campaign.thrusters:
            raise RigError(
                f"{campaign.path}: asked to run the thruster {thruster!r}, which is not in the campaign; it has "
                f"{', '.join(campaign.thrusters)}"
            )


def stop_on_signals(session: Session) -> None:
    """SIGTERM, SIGINT and SIGHUP are stop requests, carried out by the next tick (docs/reliability.md, promise 2)."""

    def stop(number: int, _: object) -> None:
        session.loop.signals.append(Request("stop", signal.Signals(number).name))

    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, stop)


def real_time() -> str:
    """Ask for real-time scheduling of this thread; says what came of it (`benchmarks/controller/loop_lateness.py`)."""
    gc.collect()
    gc.freeze()
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(10))
    except PermissionError:
        return "no real-time scheduling: not permitted to this user; the loop shares the processor with everything else"
    return "real-time scheduling (SCHED_FIFO) for the control loop"


def end_with(arguments: list[str]) -> None:
    """Run, then leave without waiting for any thread: a reader that hangs in its driver must not hold the bench."""
    status = 1
    try:
        status = main(*arguments)
    except Exception:  # the top of a process: everything is closed, and the log says why
        logging.exception("the controller failed")
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


if __name__ == "__main__":
    end_with(sys.argv[1:])
