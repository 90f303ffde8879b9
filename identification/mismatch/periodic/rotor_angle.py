"""The angle that the rotor has turned at any time."""

from __future__ import annotations

import numpy as np

from identification.recording import Floats
from identification.run_history.filters import integral


def turned(edges: Floats, speed: Floats, at: Floats) -> Floats:
    """Angle turned at each time, from the mean speed (M,) in the intervals between `edges` (M+1,): integral of |n|."""
    return integral(np.abs(speed), edges, at)


def turned_by_rate(time: Floats, rate: Floats, at: Floats) -> Floats:
    """Angle turned (rev) at each time, from samples of the rotation rate (rev/s), straight lines between them."""
    good = np.isfinite(rate)
    t, n = time[good], np.abs(rate[good])
    total = np.concatenate([[0.0], np.cumsum(0.5 * (n[1:] + n[:-1]) * np.diff(t))])
    index = np.clip(np.searchsorted(t, at, side="right") - 1, 0, t.size - 1)
    since = at - t[index]
    slope = np.append(np.diff(n) / np.maximum(np.diff(t), 1e-12), 0.0)[index]
    inside = np.clip(since, 0.0, np.append(np.diff(t), 0.0)[index])
    out: Floats = total[index] + n[index] * since + 0.5 * slope * inside**2
    return out
