"""Leaving on purpose: asked for, then either refused by the controller or settled. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from rig.console.dialogs import Leaving
from rig.console.view_model.view import View
from rig.link.front_end_messages import LogLine

SILENCE: Final = 0.5
"""s without a refusal after which a detach is taken as accepted: five snapshots."""


@dataclass(frozen=True, slots=True)
class Parting:
    """What the operator chose, and when."""

    kind: Leaving
    asked: float
    """s, the console's clock."""
    log_count: int
    """Events known when it was asked: a refusal is a later one."""


def begin(kind: Leaving, view: View, now: float) -> Parting:
    """The operator has just chosen."""
    return Parting(kind, now, view.snapshot.log_count if view.snapshot is not None else 0)


def refused(parting: Parting, view: View) -> str:
    """The controller's sentence that refuses a detach; empty: none came."""
    if parting.kind != "detach":
        return ""
    for line in _later(parting, view):
        if line.level != "info" and "detach" in line.text.lower():
            return line.text
    return ""


def settled(parting: Parting, view: View) -> bool:
    """May the console go? A stop has to be confirmed by measurement; a detach must have gone unrefused for a while."""
    if parting.kind == "detach":
        return view.now - parting.asked >= SILENCE
    snapshot = view.snapshot
    return snapshot is not None and snapshot.state == "done" and snapshot.stop_confirmed is not False


def _later(parting: Parting, view: View) -> tuple[LogLine, ...]:
    if view.snapshot is None:
        return ()
    new = min(view.snapshot.log_count - parting.log_count, len(view.snapshot.log))
    return view.snapshot.log[len(view.snapshot.log) - new :] if new > 0 else ()
