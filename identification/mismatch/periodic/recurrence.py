"""Whether a line comes again: of several runs of one machine more than one must show it, or it was seen once.

At the frequency that all runs together gave, the power in each run by itself is ranked among those at neighbouring
frequencies, which have the noise that is there, whatever its law.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.periodic.periodic_disturbances import Line
from identification.mismatch.periodic.spectrum import Series, clipped, finite
from identification.recording import Floats

NEIGHBOURS = 400
"""Frequencies on either side: ranks to 0.1 %."""
REACH = 0.2
"""Of the frequency: nearer neighbours have the noise that is at the line."""


def recurring(lines: Sequence[Line], runs: Sequence[Series]) -> tuple[tuple[Line, ...], tuple[str, ...]]:
    """The lines that come again, all of them where one run is all that could show any; a note on each other."""
    kept, notes = [], []
    for line in lines:
        p = list(_by_run(line, runs))
        shown = sum(each < policy.periodic.LINE_RECURS_P for each in p)
        if len(p) < 2 or shown > 1:
            kept.append(line)
            continue
        seen = "in one of these runs only" if shown else "in none of these runs by itself"
        notes.append(
            f"A line of {line.amplitude:.3g} N at {line.frequency:.4g} Hz shows {seen}: seen once, it is no finding."
        )
    return tuple(kept), tuple(notes)


def _by_run(line: Line, runs: Sequence[Series]) -> Iterator[float]:
    """Of each run that could show it, how often noise alone has such a power."""
    for i, run in enumerate(runs):
        series = finite(run)
        if series.time.size < policy.periodic.LINE_SAMPLES:
            continue
        parts = [(series.time >= q.start) & (series.time < q.end) for q in line.parts if q.run == i]
        angle = series.time if line.ratio is None else series.turns
        if parts and angle is not None:
            yield rank(clipped(series.residual), angle, line.frequency if line.ratio is None else line.ratio, parts)


def rank(value: Floats, angle: Floats, at: float, parts: Sequence[NDArray[np.bool_]]) -> float:
    """Share of the neighbours of `at` with as much power: of one phase throughout, or of one in each of the parts;
    doubled, as the smaller of the two counts. `angle` (n,): in periods of 1/at."""
    span = float(np.ptp(angle)) or 1.0
    far = max(REACH * at, NEIGHBOURS / span)
    near = at + far * np.linspace(-1, 1, 2 * NEIGHBOURS + 1)
    there = _powers(value, angle, at, parts)
    beside = np.array([_powers(value, angle, z, parts) for z in near if z > 0 and abs(z - at) > 1 / span])
    return float(min(2 * np.min(np.mean(beside >= there, axis=0)), 1.0))


def _powers(value: Floats, angle: Floats, at: float, parts: Sequence[NDArray[np.bool_]]) -> tuple[float, float]:
    """|sum value exp(-2 pi i angle at)|^2 over the number of samples: of all parts together, and part by part."""
    wave = value * np.exp(-2j * np.pi * at * angle)
    sums, many = np.array([wave[p].sum() for p in parts]), np.array([max(np.count_nonzero(p), 1) for p in parts])
    return float(abs(sums.sum()) ** 2 / many.sum()), float(np.sum(np.abs(sums) ** 2 / many))
