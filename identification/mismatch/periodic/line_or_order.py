"""A line of one frequency as one that goes with the rotor: with one speed no search for the rotor's lines tells them
apart, for nothing else turns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.mismatch import policy
from identification.mismatch.periodic.order_tracking import RotorOrder
from identification.mismatch.periodic.spectrum import Series, clipped
from identification.mismatch.periodic.steady_segments import speed_of
from identification.recording import Floats

SPEEDS = 100
"""Classes of speed, of which the one with most samples is the usual one."""


def as_turning(
    runs: Sequence[tuple[int, Series]], frequency: float, amplitude_std: float, p_value: float
) -> RotorOrder | None:
    """Of one phase while it turns, by least squares near the ratio that the usual speed asks for; None at rest.

    `amplitude_std`: N, of the line of one frequency: the noise is its.
    """
    from scipy.optimize import minimize_scalar  # as in lines.py

    cut, speed = _while_turning([r for _, r in runs])
    if not cut:
        return None
    noise = 0.5 * amplitude_std**2 * sum(r.time.size for _, r in runs)
    reach = 1 / (speed * max(float(np.ptp(r.time)) for _, r in runs))
    ratio = frequency / speed
    found = minimize_scalar(
        lambda z: -_gain(cut, float(z), noise),
        bounds=(ratio - reach, ratio + reach),
        method="bounded",
        options={"xatol": 1e-3 * reach},
    )
    n = np.array([turns.size for turns, _ in cut])
    gain, samples = _gain(cut, float(found.x), noise), float(n.sum())
    std = float(np.sqrt(2 * noise / samples))
    amplitude = float(np.sqrt(2 * gain * noise / samples))
    spread = float(np.sqrt(np.average([np.var(turns) for turns, _ in cut], weights=n)))
    ratio_std = std / (2 * np.pi * max(amplitude, std) * spread)
    return RotorOrder(float(found.x), ratio_std, amplitude, std, None, None, p_value, gain, speed, ())


def _while_turning(runs: Sequence[Series]) -> tuple[list[tuple[Floats, Floats]], float]:
    """(turns, residual) of each run while it turns, and the usual speed in turns per s."""
    speeds = [speed_of(r) for r in runs]
    top = max(float(s.max()) for s in speeds)
    masks = [s > policy.periodic.TURNING_SPEED * top for s in speeds]
    cut = [
        (r.turns[m], clipped(r.residual)[m])
        for r, m in zip(runs, masks, strict=True)
        if r.turns is not None and np.count_nonzero(m) > 1
    ]
    if not top > 0 or not cut:
        return [], 0.0
    every = np.concatenate([s[m] for s, m in zip(speeds, masks, strict=True)])
    count, edges = np.histogram(every, bins=SPEEDS, range=(0.0, top * (1 + 1e-9)))
    most = int(np.argmax(count))
    return cut, float(np.median(every[(every >= edges[most]) & (every <= edges[most + 1])]))


def _gain(cut: Sequence[tuple[Floats, Floats]], ratio: float, noise: float) -> float:
    """Chi-square of a wave of that many periods per turn, white noise of variance `noise`."""
    waves = (abs(value @ np.exp(-2j * np.pi * ratio * turns)) ** 2 / turns.size for turns, value in cut)
    return 2 * float(sum(waves)) / noise
