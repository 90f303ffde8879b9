"""Thrust that is unquiet after every step, until it has settled: made sample by sample."""

import numpy as np

SHARE, DECAY, TIME_CONSTANT = 0.03, 0.4, 0.15
"""Of the step, s, s."""


def late(t, F):
    """(n,) N, the thrust less its running mean: what has not settled."""
    keep = np.exp(-(t[1] - t[0]) / DECAY)
    mean = np.empty(F.size)
    mean[0] = F[0]
    for i in range(1, F.size):
        mean[i] = keep * mean[i - 1] + (1 - keep) * F[i]
    return F - mean


def unquiet(rng, share=SHARE):
    """A change of the thrust as `diagnosed_runs.run` takes one: noise of `share` of what has not settled."""

    def made(t, V, F):
        keep = np.exp(-(t[1] - t[0]) / TIME_CONSTANT)
        x = np.zeros(t.size)
        for i in range(1, t.size):
            x[i] = keep * x[i - 1] + np.sqrt(1 - keep**2) * rng.standard_normal()
        return F + share * np.abs(late(t, F)) * x

    return made
