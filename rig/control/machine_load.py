"""Whether this machine does other things, which makes samples and commands late on a line that is sound."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Final

BUSY: Final = 1.5
"""Processes that run or wait for each processor, averaged over a minute: above it most ticks wait for one that is not
ours."""


def busy(load: Callable[[], tuple[float, float, float]] = os.getloadavg, processors: int = os.cpu_count() or 1) -> str:
    """A clause for the cause of a trip; empty where the machine is idle enough.

    >>> busy(lambda: (8.2, 5.0, 3.0), 2)
    'this machine is busy (load 8.2 on 2 processors): that alone makes samples and commands late'
    >>> busy(lambda: (1.9, 5.0, 3.0), 2)
    ''
    """
    now = load()[0]
    if now <= BUSY * processors:
        return ""
    each = f"{processors} processor{'s' if processors > 1 else ''}"
    return f"this machine is busy (load {now:.1f} on {each}): that alone makes samples and commands late"
