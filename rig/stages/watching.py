"""What the campaign does with a watcher: begins each run with it, tells what it says, stops where that is asked for."""

from __future__ import annotations

from rig.control.status import Held, Status
from rig.link.front_end_messages import Request, Watching
from rig.link.watch_messages import Judged
from rig.stages.session import Session
from rig.watch.watch_link import run_of


def begin_watch(session: Session, thruster: str, t0_ns: int) -> None:
    """A run begins; what was learnt of another mounting is forgotten."""
    status = session.status
    session.watched = session.loop.watcher is not None
    status.watch, status.held = Watching("learning" if session.watched else "off"), []
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
        session.say("warning", f"mismatch: {found.statement}")
        if session.campaign.watch.stop:
            session.loop.signals.append(Request("stop", f"the watch (watch.stop = true): {found.headline}"))
    if watch.judged is not None and watch.judged is not session.judged:
        session.judged = watch.judged
        session.status.watch = shown(watch.judged, session.status)
    if watch.failed:
        session.watched = False
        session.status.watch = Watching("failed", watch.failed)
        session.say("warning", f"this run is not watched for mismatches: {watch.failed}")


def shown(judged: Judged, status: Status) -> Watching:
    """For the screens: with the steps and levels at which a mismatch shows."""
    found = judged.mismatch
    if found is None:
        return Watching("fits" if judged.enough else "learning")
    later = [held for held in status.held if (held.begin + held.end) / 2 > found.began and shows(found.place, held)]
    return Watching(
        "mismatch", found.what,
        step=later[0].index if later else None,
        low=min((held.voltage for held in later), default=None),
        high=max((held.voltage for held in later), default=None),
        began=found.began, from_start=found.from_start, sigma=found.sigma, brief=found.brief, advice=found.advice,
    )  # fmt: skip


def shows(place: str, held: Held) -> bool:
    """Whether a mismatch of that place is to be seen in what was held."""
    match place:
        case "zero":
            return True
        case "forward":
            return held.voltage > 0
        case "reverse":
            return held.voltage < 0
        case _:
            return held.voltage != 0


def end_watch(session: Session) -> None:
    """The run is over."""
    hear_watch(session)
    if session.loop.watcher is not None:
        session.loop.watcher.end()
