"""Standard errors of many short holds made to lend each other degrees of freedom (moderated variances).

Weights 1 / s_i^2 from few degrees of freedom overstate what a weighted fit knows: holds whose s_i came out small by
luck weigh most (Meier, Biometrics 1953). The variances are therefore shrunk towards their common level, which may grow
with the load, by the empirical Bayes rule of Smyth (Stat. Appl. Genet. Mol. Biol. 2004): the more alike, the more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import digamma, polygamma

from identification.recording import Floats

MOST_DOF = 1e6
FEWEST_POINTS = 4


@dataclass(frozen=True, eq=False)
class Moderated:
    """Standard errors (n,) and their degrees of freedom (n,)."""

    std_error: Floats
    dof: Floats


def inverse_trigamma(value: float) -> float:
    """Solve trigamma(x) = value for x (Newton on 1 / trigamma, Smyth 2004 appendix).

    >>> round(inverse_trigamma(float(polygamma(1, 3.0))), 6)
    3.0
    """
    x = 0.5 + 1 / value
    for _ in range(50):
        step = float(polygamma(1, x) * (1 - polygamma(1, x) / value) / polygamma(2, x))
        x += step
        if abs(step) < 1e-8 * x:
            break
    return x


def moderate(std_error: Floats, dof: Floats, load: Floats) -> Moderated:
    """Shrink log variances towards a straight line in `load` (n,) >= 0, e.g. |thrust|; under 4 points nothing is done.

    >>> rng = np.random.default_rng(0)
    >>> raw = np.sqrt(rng.chisquare(5, 40) / 5)
    >>> shrunk = moderate(raw, np.full(40, 5.0), np.zeros(40))
    >>> bool(shrunk.std_error.std() < 0.3 * raw.std())
    True
    """
    usable = (std_error > 0) & (dof > 0)
    if usable.sum() < FEWEST_POINTS:
        return Moderated(std_error, dof)
    d = np.minimum(dof[usable], MOST_DOF)
    centred = 2 * np.log(std_error[usable]) - digamma(d / 2) + np.log(d / 2)
    noise = polygamma(1, d / 2)
    columns = np.ones((d.size, 1))
    if d.size >= 2 * FEWEST_POINTS and np.ptp(load[usable]) > 0:
        columns = np.column_stack([columns, load[usable] / load[usable].max()])
    root = 1 / np.sqrt(noise + 0.1)
    theta, *_ = np.linalg.lstsq(columns * root[:, None], centred * root, rcond=None)
    level = columns @ theta
    excess = float(np.sum((centred - level) ** 2) / (d.size - columns.shape[1]) - noise.mean())
    prior = min(2 * inverse_trigamma(excess), MOST_DOF) if excess > 1e-6 else MOST_DOF
    common = np.exp(level + digamma(prior / 2) - np.log(prior / 2))
    variance = (prior * common + d * std_error[usable] ** 2) / (prior + d)
    out, out_dof = std_error.copy(), dof.copy()
    out[usable] = np.sqrt(variance)
    out_dof[usable] = np.minimum(prior + d, float(d.sum()))
    return Moderated(out, out_dof)
