"""A device obeys when a frame comes, however busy the machine is: so the process that plays devices goes first."""

from __future__ import annotations

import contextlib
import os

PRIORITY = 1
"""Below every real-time thread that asks for more: a control loop on this machine goes before its bench."""


def on_time() -> None:
    """Real-time scheduling for this thread and none of its children; where it is not permitted, as before."""
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(PRIORITY))


def give_way() -> None:
    """Back among all others, for a world that this machine cannot keep up with must not hold it."""
    if os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_FIFO:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
