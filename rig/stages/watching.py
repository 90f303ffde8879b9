"""What the campaign does with a watcher: begins each run with it, tells what it says, stops where that is asked for."""

from __future__ import annotations

from rig.link.front_end_messages import Request
from rig.stages.session import Session
from rig.watch.watch_link import run_of


def begin_watch(session: Session, thruster: str, t0_ns: int) -> None:
    """A run begins; what was learnt of another mounting is forgotten."""
    session.status.mismatch = ""
    session.watched = session.loop.watcher is not None
    if session.loop.watcher is not None:
        loop = session.loop
        session.loop.watcher.begin(
            run_of(session.campaign, loop.readings.streams, loop.thrust_channel, thruster, t0_ns)
        )


def hear_watch(session: Session) -> None:
    """A mismatch goes to the screens, into the recording's events and into the ledger. Never blocks.

    One of a run that is over goes into the ledger alone: it is no matter of the recording that is open now.
    """
    watch = session.loop.watcher
    if watch is None or not session.watched:
        return
    for found in watch.heard():
        late = found.t0_ns != watch.t0_ns
        session.ledger.write(
            "mismatch", thruster=found.thruster, time=found.time, began=found.began, place=found.place,
            size_N=found.size, e_value=found.e_value, late=late,
        )  # fmt: skip
        if late:
            continue
        session.status.mismatch = found.headline
        session.say("warning", f"mismatch: {found.statement}")
        if session.campaign.watch.stop:
            session.loop.signals.append(Request("stop", f"the watch (watch.stop = true): {found.headline}"))
    if watch.failed:
        session.watched = False
        session.say("warning", f"this run is not watched for mismatches: {watch.failed}")


def end_watch(session: Session) -> None:
    """The run is over."""
    hear_watch(session)
    if session.loop.watcher is not None:
        session.loop.watcher.end()
