"""The rotor n' = alpha ((k V)|k V| - n|n|) + gamma (k V - n) simulated for many parameter sets and pieces at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.recording import Floats
from identification.thruster.rotor_data import STEP, Drive, steps_of

FASTEST = 1e4
"""rev/s: beyond it a trial step of the optimiser is no rotor."""


def simulate(drives: Sequence[Drive], alpha: Floats, k: Floats, gamma: Floats, delay: Floats) -> Floats:
    """Rate (s, n) at the samples of all drives for s parameter sets (s,): Runge and Kutta, Hermite between steps."""
    steps, sets = steps_of(drives), alpha.size
    inputs = [[d.mean_input(steps, float(late)) for d in drives] for late in delay]
    square = np.array([np.concatenate([q for q, _ in row]) for row in inputs])
    plain = np.array([np.concatenate([v for _, v in row]) for row in inputs])
    push = (alpha * k * np.abs(k))[:, None, None] * square + (gamma * k)[:, None, None] * plain
    first = np.concatenate([d.first for d in drives])
    rate, slope = _integrate(np.tile(first, (sets, 1)), push, alpha[:, None], gamma[:, None])
    return np.concatenate([_sampled(d, rate, slope, at) for d, at in zip(drives, lanes(drives), strict=True)], axis=1)


def lanes(drives: Sequence[Drive]) -> list[int]:
    """First lane of each drive's pieces."""
    return [sum(d.starts.size for d in drives[:i]) for i in range(len(drives))]


def _integrate(n: Floats, push: Floats, alpha: Floats, gamma: Floats) -> tuple[Floats, Floats]:
    """Rates and their slopes (steps + 1, s, c) at the step ends; push (s, c, steps) rev/s^2, constant in each step."""
    steps = push.shape[2]
    rates, slopes = np.empty((steps + 1, *n.shape)), np.empty((steps + 1, *n.shape))

    def pull(x: Floats) -> Floats:
        out: Floats = (alpha * np.abs(x) + gamma) * x
        return out

    for i in range(steps):
        p = push[:, :, i]
        a = p - pull(n)
        rates[i], slopes[i] = n, a
        b = p - pull(n + 0.5 * STEP * a)
        c = p - pull(n + 0.5 * STEP * b)
        d = p - pull(n + STEP * c)
        n = np.clip(n + STEP / 6 * (a + 2 * b + 2 * c + d), -FASTEST, FASTEST)
    rates[steps], slopes[steps] = n, push[:, :, -1] - pull(n)
    return rates, slopes


def _sampled(d: Drive, rate: Floats, slope: Floats, lane: int) -> Floats:
    """(s, n) by cubic Hermite interpolation; the slope at a step's end is that of its own force."""
    where = (d.time - d.starts[d.piece]) / STEP
    i = np.minimum(where.astype(np.intp), rate.shape[0] - 2)
    x, lanes = where - i, lane + d.piece
    y0, y1, m0 = rate[i, :, lanes].T, rate[i + 1, :, lanes].T, STEP * slope[i, :, lanes].T
    m1 = 2 * (y1 - y0) - m0  # parabola through both ends with the first slope: the force jumps at step ends
    out: Floats = y0 + x * (m0 + x * (3 * (y1 - y0) - 2 * m0 - m1 + x * (2 * (y0 - y1) + m0 + m1)))
    return out
