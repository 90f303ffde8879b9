"""A stamp is as good as its thread is prompt: readers go ahead of the machine's other work where the loop does."""

from __future__ import annotations

import contextlib
import os
import sys


def on_time() -> None:
    """Real-time scheduling for the calling thread, one below the main thread's, where that has it.

    A reader only stamps and puts away, so that it holds nobody up; and one that were preempted by the machine's other
    work while it has the interpreter would hold up the loop.
    """
    if sys.platform != "linux":
        return
    main = os.getpid()
    if os.sched_getscheduler(main) & ~os.SCHED_RESET_ON_FORK != os.SCHED_FIFO:
        return
    priority = max(os.sched_getparam(main).sched_priority - 1, 1)
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
