"""What the console knows: a frozen view folded from snapshots. Pure; the clock is an argument."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final, Literal

from rig.link.front_end_messages import Point, Snapshot, TraceRow

FRESH: Final = 0.5
"""s; snapshots come ten times a second, so five in a row are missing when one is older than this."""
TRACE_KEPT: Final = 120.0
"""s of trace kept and drawn: a dozen holds, and short enough to see one settle; as much as the controller sends."""

Condition = Literal["waiting", "live", "stale", "disconnected"]


@dataclass(frozen=True, slots=True)
class View:
    """All that is drawn is a function of this."""

    now: float = 0.0
    """s, the console's clock."""
    snapshot: Snapshot | None = None
    """The newest one."""
    received: float = 0.0
    """s, when the newest snapshot came."""
    connected: bool = True
    points: Mapping[str, tuple[Point, ...]] = field(default_factory=dict)
    """Finished holds of each thruster seen since this console attached, in order of appearance."""
    trace: tuple[TraceRow, ...] = ()
    """Of the running recording; its channels are those of the snapshot."""
    plotted: str = ""
    """Channel on the time plot, as the operator chose it; empty: the thrust."""
    looks_on: bool = False
    """It does not attend, and asks for nothing but a stop."""
    stop_asked: float | None = None
    """s, when the stop key was pressed first; None: not yet."""
    zero_after: float | None = None
    """s from then until a snapshot said that the command is 0 V."""
    stop_failed: str = ""
    """Why the stop could not be sent; empty: it was."""

    @property
    def silence(self) -> float:
        """In s, since the newest snapshot; inf before the first."""
        return self.now - self.received if self.snapshot is not None else float("inf")

    @property
    def condition(self) -> Condition:
        """Whether what is shown may be taken for the present."""
        if not self.connected:
            return "disconnected"
        if self.snapshot is None:
            return "waiting"
        return "live" if self.silence <= FRESH else "stale"


def absorb(view: View, snapshot: Snapshot, now: float) -> View:
    """The view after one more snapshot, received at `now` in s."""
    return replace(
        view,
        now=now,
        snapshot=snapshot,
        received=now,
        points=_with_points(view.points, snapshot),
        trace=_with_trace(view, snapshot),
        zero_after=_zero_after(view, snapshot, now),
        looks_on=view.looks_on or (view.snapshot is None and snapshot.clients > 1),
    )


def _zero_after(view: View, snapshot: Snapshot, now: float) -> float | None:
    if view.zero_after is not None or view.stop_asked is None:
        return view.zero_after
    if view.snapshot is not None and _stopped(view.snapshot):
        return None  # the key came after the stop: there is nothing to measure
    return now - view.stop_asked if _stopped(snapshot) else None


def _stopped(snapshot: Snapshot) -> bool:
    return snapshot.command == 0 and snapshot.state in ("stopping", "run_done", "done")


def _with_points(known: Mapping[str, tuple[Point, ...]], snapshot: Snapshot) -> Mapping[str, tuple[Point, ...]]:
    """`snapshot.points` is the whole list of its run, so it replaces; a run with none yet keeps what was."""
    if not snapshot.points:
        return known
    thruster = snapshot.points[-1].thruster or snapshot.thruster
    if known.get(thruster) == snapshot.points:
        return known
    return {**known, thruster: snapshot.points}


def _with_trace(view: View, snapshot: Snapshot) -> tuple[TraceRow, ...]:
    before = view.snapshot
    same_run = before is not None and before.thruster == snapshot.thruster and before.files == snapshot.files
    old = view.trace if same_run else ()
    if not snapshot.trace:
        return old
    first, last = snapshot.trace[0][0], snapshot.trace[-1][0]
    return tuple(row for row in old if last - TRACE_KEPT <= row[0] < first) + snapshot.trace
