"""Main of the controller process: one campaign on one bench, alone on it, deaf to the terminal, stopped by any signal.

python -m rig.controller CAMPAIGN FOLDER [THRUSTER ...]
"""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

from rig.campaign import SOCKET_NAME, CampaignRun
from rig.loading import load_campaign
from rig.errors import RigError
from rig.link import socket_path
from rig.messages import Request
from rig.runs import Run, lock_bench, register


def main(campaign_path: str, folder_path: str, *thrusters: str) -> int:
    """Run the campaign; 0 once it has ended in order, however it went, 2 for a campaign that can't be begun."""
    folder = Path(folder_path)
    try:
        campaign = load_campaign(Path(campaign_path))
        with lock_bench(campaign.bench.path):
            run = CampaignRun(campaign, folder, thrusters)
            stop_on_signals(run)
            socket = str(socket_path(folder, SOCKET_NAME))
            announcement = register(Run(os.getpid(), socket, str(folder), campaign.name, str(campaign.bench.path)))
            try:
                run.run()
            finally:
                announcement.unlink(missing_ok=True)
    except RigError as error:
        sys.stderr.write(f"rig: {error}\n")
        return 2
    return 0


def stop_on_signals(run: CampaignRun) -> None:
    """SIGTERM, SIGINT and SIGHUP are stop requests, carried out by the next tick (reliability.md, promise 2)."""

    def stop(number: int, _: object) -> None:
        run.loop.signals.append(Request("stop", signal.Signals(number).name))

    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, stop)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
