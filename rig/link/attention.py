"""What an operator who looks elsewhere must come for, and when a bell says so: at most once each. Pure."""

from __future__ import annotations

from typing import Final

from rig.link.front_end_messages import Snapshot

PATIENCE: Final = 10.0
"""s between two rings for what may come and go, such as a link."""
COMES_AGAIN: Final = ("danger", "paused")
"""All else rings once in a campaign; a pause once each time."""


def wanted_for(snapshot: Snapshot) -> str:
    """What somebody must come for, in a word or two; empty: nothing."""
    if snapshot.state == "mount" and snapshot.mounted_by_hand:
        return f"mount {snapshot.thruster}"
    ready = snapshot.state == "preflight" and all(c.verdict in ("passed", "warning") for c in snapshot.checks)
    if ready and snapshot.checks:
        return "ready"
    if snapshot.outcome == "tripped" and snapshot.state == "stopping":
        return "tripped"
    return snapshot.state if snapshot.state in ("paused", "done") else ""


class Bell:
    """Remembers what has rung."""

    def __init__(self) -> None:
        self._now = ""
        self._heard: dict[str, float] = {}

    def rings(self, wanted: str, now: float) -> bool:
        """Whether to ring for `wanted` at `now` s; it is asked again and again while somebody is wanted."""
        if wanted == self._now:
            return False
        self._now = wanted
        if not wanted or not self._may(wanted, now):
            return False
        self._heard[wanted] = now
        return True

    def _may(self, wanted: str, now: float) -> bool:
        if wanted not in self._heard:
            return True
        return wanted in COMES_AGAIN and (wanted == "paused" or now - self._heard[wanted] >= PATIENCE)
