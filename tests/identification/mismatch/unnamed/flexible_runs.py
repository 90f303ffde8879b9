"""Runs that a flexible term is fitted to."""

import numpy as np

from identification.run_history.history import History


def history(M=40, **others):
    edges = np.linspace(0.0, 20.0, M + 1)
    volts = np.where(edges[:-1] < 10, 4.0, -8.0)
    middle = 0.5 * (edges[1:] + edges[:-1])
    return History(
        "r",
        "command_voltage",
        edges,
        volts,
        np.zeros(M),
        np.ones(M, dtype=np.int64),
        middle,
        np.zeros(M),
        others=others,
    )
