"""One term on a made-up run, its neutral amounts, what it predicts."""

import numpy as np
from scipy.integrate import solve_ivp

from identification.physics.catalogue import CATALOGUE
from tests.identification.physics.runs_on_intervals import history, scale, uneven

H = history()


S = scale(H)


def term(name, form=""):
    return next(t for t in CATALOGUE if t.id == name and form in (t.form, ""))


def base(h=H, C=0.5):
    return C * h.driver * np.abs(h.driver)


def integrated(slope, y0, u, dt, seen=0):
    """Ends (M, k) and means (M,) of component `seen` of y' = slope(y, u), u constant in each interval."""
    y, ends, means = np.append(y0, 0.0), [], []
    for value, width in zip(u, dt, strict=True):
        y[-1] = 0.0
        found = solve_ivp(lambda _t, z, v=value: [*slope(z[:-1], v), z[seen]], (0.0, width), y, rtol=1e-10, atol=1e-12)
        y = found.y[:, -1].copy()
        ends.append(y[:-1].copy())
        means.append(y[-1] / width)
    return np.array(ends), np.array(means)


def steps(n, seed=3, low=0.004, high=0.25):
    rng = np.random.default_rng(seed)
    return np.repeat(rng.uniform(-10, 10, n // 5), 5), uneven(rng, n // 5 * 5, low, high)
