"""A controller process whose run begins again after each stop, so that a hundred presses need one preflight.

    python benchmarks/console/begins_again.py CAMPAIGN FOLDER

All in it is the rig's: session, preflight, loop, guard, sequencer, recorder. Only what follows a stop differs: where
`rig.stages.controller` says goodbye, the next run of the same thruster begins, into a file of its own. Each run shows
what a console shows late on a day: two minutes of trace and forty points. When the motor's driver has taken 0, the
time goes into FOLDER/zeros, ns of the monotonic clock. SIGTERM ends it.
"""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from math import sin
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from rig.campaign.loading import load_campaign
from rig.link.front_end_messages import Point, TraceRow
from rig.link.live_runs import Run, lock_bench, register
from rig.link.sockets import socket_path
from rig.stages.arming import preflight
from rig.stages.campaign import SOCKET_NAME, open_session
from rig.stages.controller import real_time, stop_on_signals
from rig.stages.measuring import measure
from rig.stages.session import Session, Stopped

MINUTES, ROWS_PER_SECOND, POINTS = 2, 10, 40
TRACE = tuple(
    (t / ROWS_PER_SECOND, 6.0 * sin(t / 400), 15.0 * sin(t / 400) * abs(sin(t / 400)) + 0.2 * sin(3.7 * t))
    for t in range(-MINUTES * 60 * ROWS_PER_SECOND, 0)
)
"""(s, V, N) before the run: what a front end is sent of a run that has gone on for as long."""


def as_traced(channels: int) -> list[TraceRow]:
    """`TRACE` as the envelope of so many channels, the command first."""
    return [(t, V, V, *((N - 0.2, N + 0.2) * (channels - 1))) for t, V, N in TRACE]


def earlier_points(thruster: str) -> list[Point]:
    """Holds between -10 and 10 V."""
    volts = [20.0 * k / (POINTS - 1) - 10.0 for k in range(POINTS)]
    return [Point(k, V, 0.4 * V * abs(V) + 0.1 * sin(k), 0.05, 4.0, k % 9 != 0, thruster) for k, V in enumerate(volts)]


def with_a_past(session: Session) -> Callable[[float], None]:
    """`publish` of the loop, which puts `TRACE` before the rows of each new recording, and notes zeros: in the tick of
    a stop it is called right after the command."""
    publish, loop, given, driven = session.loop.publish, session.loop, list[int](), [False]
    zeros = (session.folder / "zeros").open("w", buffering=1)

    def published(now: float) -> None:
        if driven[0] and loop.command == 0.0:
            zeros.write(f"{loop.clock.now_ns()}\n")
        driven[0] = loop.command != 0.0
        begun = loop.recording_since_ns
        if begun is not None and begun not in given[-1:]:
            given.append(begun)
            rows = [*as_traced(len(loop.envelopes.channels)), *loop.clients.trace]
            loop.clients.clear_trace()
            for row in rows:
                loop.clients.add_trace(row)
        publish(now)

    return published


def run_again_and_again(session: Session) -> None:
    """Until a signal."""
    session.loop.publish = with_a_past(session)
    preflight(session)
    while True:
        session.status.points[:] = earlier_points(session.status.thruster)
        del session.status.files[:-2]
        try:
            measure(session)
        except Stopped as stop:
            if stop.outcome == "tripped" or "SIG" in str(stop):
                raise  # after a lapse nothing goes on by itself, here neither
        session.rest()
        session.loop.begin_guarding()


def main(campaign_path: str, folder_path: str) -> int:
    """0 after a signal."""
    folder = Path(folder_path)
    campaign = load_campaign(Path(campaign_path))
    with lock_bench(campaign.bench.path):
        session = open_session(campaign, folder, ())
        stop_on_signals(session)
        session.say("info", real_time(), of_bench=True)
        socket = str(socket_path(folder, SOCKET_NAME))
        announced = register(Run(os.getpid(), socket, str(folder), campaign.name, str(campaign.bench.path)))
        try:
            with suppress(Stopped):
                run_again_and_again(session)
        finally:
            session.rest()
            session.close()
            announced.unlink(missing_ok=True)
    return 0


if __name__ == "__main__":
    STATUS = 1
    try:
        STATUS = main(*sys.argv[1:])
    except Exception:
        logging.exception("the controller failed")
    finally:
        os._exit(STATUS)  # a reader that hangs in its driver must not hold the bench
