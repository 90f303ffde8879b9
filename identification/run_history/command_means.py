"""What a curve of the command is on average over each interval, tick by tick."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from identification.recording import Floats
from identification.run_history.history import History


def command_means(history: History, curve: Callable[[Floats], Floats]) -> Floats:
    """(M,) of the `curve` of every tick (n,) of a command that is held between; it is 0 of none."""
    assert history.ticks is not None
    when, command = history.ticks
    knots = np.append(when, max(float(when[-1]), float(history.edges[-1])) + 1.0)
    area = np.concatenate([[0.0], np.cumsum(curve(command) * np.diff(knots))])
    out: Floats = np.diff(np.interp(history.edges, knots, area)) / np.diff(history.edges)
    return out
