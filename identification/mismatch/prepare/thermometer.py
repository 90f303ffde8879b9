"""A motor's temperature between and beyond its noisy samples: what the load makes of it, and the slow rest.

C is that of the motor as cold as it began, and one sample has all of the noise; a running mean rounds off what a
temperature does when the load steps, and is told as an effect that follows a step late.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from identification.mismatch import policy
from identification.mismatch.prepare.channels import REACHES, calmest, followed
from identification.mismatch.prepare.measured_driver import noise_of
from identification.mismatch.prepare.scales import THERMOMETER
from identification.recording import Channel, Floats, Recording
from identification.run_history.filters import lowpass

FASTEST = 3.0
"""s, least time constant of a motor's heat that is tried; the greatest is the duration of the run."""
TIMES = 15
"""Time constants that are tried, and once more round the best."""
POWERS = (2, 3, 4)
"""Of the driver: copper loss goes as the fourth, of a motor that loses voltage before it as less."""
FEWEST = 8
"""Samples of the shortest window at the beginning; each next one has twice as many."""
MOST_MISFIT = 2.0
"""sigma of chi-square by which a parabola may miss the samples of a window that it is believed over."""


def warmed(
    recording: Recording, edges: Floats, driven: Floats, others: Mapping[str, Floats]
) -> tuple[dict[str, Floats], float]:
    """`others` with the motor's temperature as it was, and the standard error of the first in K; 0 without any."""
    thermometer = recording.first_of(THERMOMETER)
    if thermometer is None or THERMOMETER not in others:
        return dict(others), 0.0
    current = others.get("current")
    loads = [driven] if current is None else [driven, np.sqrt(np.abs(np.nan_to_num(current)))]
    found = warmth(thermometer, edges, loads)
    return (dict(others), 0.0) if found is None else ({**others, THERMOMETER: found[0]}, found[1])


def warmth(channel: Channel, edges: Floats, loads: Sequence[Floats]) -> tuple[Floats, float] | None:
    """(M,) the temperature in the intervals, in the channel's unit, and the standard error of the first of them.

    Of the powers of one of the `loads`, which go as the voltage, low-passed with one time constant, of a decay from
    what was there before, and of what these leave, where it is plainly more than noise. None without two samples.
    """
    good = np.isfinite(channel.value)
    time, value, middle = channel.time[good], channel.value[good], 0.5 * (edges[1:] + edges[:-1])
    plain = followed(channel, middle)
    if plain is None:
        return None
    noise, step = noise_of(value), channel.acquisition.quantum or 0.0
    if value.size < 4 * (len(POWERS) + 2) or not noise:
        return plain, float(np.hypot(noise, step / np.sqrt(12.0)))
    columns, theta, _ = min((_by_load(time, value, edges, load) for load in loads), key=lambda found: found[2])
    H = _at(time, middle, columns)
    rest = value - H @ theta
    unsure = noise**2 * columns[0] @ np.linalg.pinv(H.T @ H) @ columns[0] + step**2 / 12
    out: Floats = columns @ theta
    smooth, missed = calmest(rest, (1, *REACHES), step)
    if missed > (1 - 1 / np.sqrt(rest.size)) * float(np.mean(rest**2)):
        return out, float(np.sqrt(unsure))
    smooth[0], error = first_reading(time, rest)
    return out + np.interp(middle, time, smooth), float(np.sqrt(unsure + error**2))


def first_reading(time: Floats, value: Floats) -> tuple[float, float]:
    """The value at the first sample (n,) and its standard error, in its unit.

    Parabolas are laid through the samples of longer and longer windows from there on, while they fit and agree with the
    shorter ones; what is told is of half the longest, as the longest just begins to bend otherwise (Lepski, Theory
    Probab. Appl. 35, 1990, 454; undersmoothing: Hall, Ann. Stat. 20, 1992, 675).
    """
    noise = noise_of(value)
    found = _believed(time, value, noise) if noise > 0 else []
    return found[max(len(found) - 2, 0)] if found else (float(value[0]), noise)


def _by_load(time: Floats, value: Floats, edges: Floats, driven: Floats) -> tuple[Floats, Floats, float]:
    """(M, p) columns in the intervals, how much there is of each (p,), and the sum of squares left, of the time
    constant that leaves least."""
    middle, dt = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    load = np.abs(driven) / (float(np.max(np.abs(driven))) or 1.0)

    def of(tau: float) -> tuple[Floats, Floats, float]:
        gone = np.exp(-(middle - middle[0]) / tau)
        columns = np.column_stack([np.ones(middle.size), gone, *(lowpass(load**p, dt, tau)[1] for p in POWERS)])
        H = _at(time, middle, columns)
        theta: Floats = np.linalg.lstsq(H, value, rcond=1e-9)[0].astype(np.float64)
        return columns, theta, float(np.sum((value - H @ theta) ** 2))

    slowest = max(float(edges[-1] - edges[0]), 2 * FASTEST)
    coarse = np.geomspace(FASTEST, slowest, TIMES)
    near = min(coarse.tolist(), key=lambda tau: of(tau)[2])
    ratio = coarse[1] / coarse[0]
    return min((of(tau) for tau in np.geomspace(near / ratio, near * ratio, TIMES)), key=lambda found: found[2])


def _at(time: Floats, middle: Floats, columns: Floats) -> Floats:
    return np.column_stack([np.interp(time, middle, column) for column in columns.T])


def _believed(time: Floats, value: Floats, noise: float) -> list[tuple[float, float]]:
    """Of each window that is believed, the shortest first."""
    out: list[tuple[float, float]] = []
    low, high, many = -np.inf, np.inf, FEWEST
    while many <= value.size:
        late = (time[:many] - time[0]) / (time[many - 1] - time[0])
        columns = np.column_stack([np.ones(many), late, late**2])
        theta = np.linalg.lstsq(columns, value[:many], rcond=None)[0]
        error = noise * float(np.sqrt(np.linalg.inv(columns.T @ columns)[0, 0]))
        free = many - columns.shape[1]
        missed = float(np.sum((value[:many] - columns @ theta) ** 2)) / noise**2
        reach = policy.prepare.SMOOTHING_AGREES_SIGMA * error
        low, high = max(low, theta[0] - reach), min(high, theta[0] + reach)
        if low > high or missed > free + MOST_MISFIT * float(np.sqrt(2.0 * free)):
            break
        out.append((float(theta[0]), error))
        many *= 2
    return out
