"""Which thrusters left their limits, alone or as a stretch of the production, and which of them are to be diagnosed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.control_charts.charts import Stretch
from rig.fleet.question import Row
from rig.fleet_report.figures_of_units import Charted

OF_EACH_STRETCH = 2
"""Units of a stretch that are diagnosed: those that are most like its others."""


@dataclass(frozen=True)
class Alone:
    """One unit outside. `off`: (name of a figure, deviation in sigma, the same as shown), most first."""

    place: int
    off: tuple[tuple[str, float, float], ...]

    @property
    def most(self) -> float:
        return abs(self.off[0][1])


@dataclass(frozen=True)
class Together:
    """A stretch of the production whose mean is off, by one figure."""

    charted: Charted
    stretch: Stretch
    places: tuple[int, ...]
    """Of all its units."""
    size: float
    """Median deviation as shown."""


@dataclass(frozen=True)
class Departures:
    """Of a fleet."""

    alone: tuple[Alone, ...]
    together: tuple[Together, ...]

    @property
    def places(self) -> frozenset[int]:
        """Of all units that are in one or the other."""
        return frozenset(each.place for each in self.alone) | {k for each in self.together for k in each.places}


def departures_of(charts: Sequence[Charted]) -> Departures:
    """Most far out first; stretches by their size."""
    together = [_together(charted, stretch) for charted in charts for stretch in charted.chart.stretches]
    off: dict[int, list[tuple[str, float, float]]] = {}
    for charted in charts:
        deviation = charted.chart.deviation
        within = _within(charted)
        for at in np.flatnonzero(charted.chart.outside & ~within).tolist():
            z = float(deviation[at])
            off.setdefault(int(charted.places[at]), []).append((charted.figure.name, z, charted.shown(z, at)))
    alone = [Alone(place, tuple(sorted(each, key=lambda item: -abs(item[1])))) for place, each in off.items()]
    alone.sort(key=lambda each: (-each.most, each.place))
    together.sort(key=lambda each: (-abs(each.stretch.size) * len(each.places) ** 0.5, each.places))
    return Departures(tuple(alone), tuple(together))


def _together(charted: Charted, stretch: Stretch) -> Together:
    at = slice(stretch.first, stretch.last + 1)
    places = tuple(int(place) for place in charted.places[at])
    shown = charted.chart.deviation[at] * charted.chart.sigma[at] * charted.figure.scale
    return Together(charted, stretch, places, float(np.median(shown)))


def _within(charted: Charted) -> NDArray[np.bool_]:
    """Units of a stretch that are off to its side; one that is off to the other stands for itself."""
    out = np.zeros(charted.chart.value.size, dtype=bool)
    for stretch in charted.chart.stretches:
        at = slice(stretch.first, stretch.last + 1)
        out[at] |= charted.chart.deviation[at] * stretch.size > 0
    return out


def to_diagnose(rows: Sequence[Row], charts: Sequence[Charted], found: Departures, most: int) -> tuple[int, ...]:
    """Places of the units to be diagnosed, `most` of them, most telling first: each that is out alone, some of each
    stretch, and one as usual as any, beside which the others are read."""
    if most == 0 or not charts:
        return ()
    typical = [] if not found.places else [usual(rows, charts, found)]
    stretched = [place for each in found.together for place in _most_alike(each)]
    wanted = [*typical, *stretched, *(each.place for each in found.alone)]
    return tuple(dict.fromkeys(wanted))[: most + len(typical)]


def _most_alike(each: Together) -> list[int]:
    at = slice(each.stretch.first, each.stretch.last + 1)
    distance = np.abs(each.charted.chart.deviation[at] - each.stretch.size)
    return [each.places[k] for k in np.argsort(distance, kind="stable")[:OF_EACH_STRETCH].tolist()]


def usual(rows: Sequence[Row], charts: Sequence[Charted], found: Departures) -> int:
    """The place of the unit that is nearest to the centre of all charts, among those that left none."""
    worst = np.zeros(len(rows))
    told = np.zeros(len(rows))
    for charted in charts:
        worst[charted.places] = np.maximum(worst[charted.places], np.abs(charted.chart.deviation))
        told[charted.places] += 1
    worst[told < len(charts)] = np.inf
    worst[list(found.places)] = np.inf
    return int(np.argmin(worst))
