"""The rows of one bench as the looks that the consistency check judges: which channels there are, and its trip."""

from __future__ import annotations

from collections.abc import Iterable
from math import isnan
from statistics import fmean

from drivers.protocols import Sample
from rig.campaign.bench import Bench
from rig.safety.consistency.look import Look
from rig.safety.consistency.watch import Consistency
from rig.safety.guard import Trip

FLOWS = 0.05
"""m/s of measured flow from which on thrust goes with the speed of advance too."""
DO = "look at the propeller, the sensors and their scales, then begin anew"

_Place = tuple[str, int]


class ConsistencyWatch:
    """Of one bench; `begin_run` forgets what the last thruster was like."""

    def __init__(self, bench: Bench, rotation: str | None, thrust: str) -> None:
        """`rotation`, `thrust`: channels, as `<stream>.<channel>`."""
        places = {
            f"{s.name}.{c.name}": (s.name, i, c.quantity) for _, s in bench.streams() for i, c in enumerate(s.channels)
        }
        self._config = bench.config
        self._thrust = places[thrust][:2]
        self._rate = places[rotation][:2] if rotation is not None else None
        self._current = self._beside(places.values(), "current")
        self._places = (("rotation rate", self._rate), ("current", self._current), ("thrust", self._thrust))
        self._flow = [(stream, column) for stream, column, quantity in places.values() if quantity == "flow_speed"]
        self._flowing = False
        self.begin_run()

    def begin_run(self) -> None:
        self._check = Consistency(self._config.rest_rate, self._config.max_voltage)

    def advance(self, samples: tuple[Sample, ...], command: float | None, now: float) -> Trip | None:
        """`command`: V sent in the last tick, None: nothing was."""
        rows: dict[str, list[Sample]] = {}
        for sample in samples:
            rows.setdefault(sample.stream, []).append(sample)
        for place in self._flow:
            flow = _mean(rows, place)
            self._flowing = self._flowing if flow is None else abs(flow) > FLOWS
        look = Look(
            now, command, _mean(rows, self._rate), _mean(rows, self._current), _mean(rows, self._thrust), self._flowing
        )
        cause = self._check.advance(look)
        if not cause or not self._config.consistency:
            return None
        return Trip(f"command, rotation, current and thrust contradict: {cause}; {DO}", "inconsistent", now)

    @property
    def rests_on(self) -> str:
        """For who runs it: what the check has to go by on this bench."""
        known = [name for name, place in self._places if place is not None]
        text = f"the command is compared with {_listed(known)}"
        return f"{text}; not measured: {_listed(self.lacking)}" if self.lacking else text

    @property
    def lacking(self) -> list[str]:
        """What is not measured on this bench."""
        return [name for name, place in self._places if place is None]

    def told(self) -> str:
        """What this run has taught; empty while too little."""
        return self._check.told()

    def doubts(self, expected_C: float | None) -> list[str]:
        """What nothing ends a run for and somebody should look at; `expected_C` in N/V^2."""
        return self._check.doubts(expected_C)

    def _beside(self, places: Iterable[tuple[str, int, str | None]], quantity: str) -> _Place | None:
        """Of the rotation's own stream, else the first."""
        found = [(stream, column) for stream, column, what in places if what == quantity]
        own = self._rate[0] if self._rate is not None else ""
        return min(found, key=lambda place: place[0] != own, default=None)


def _mean(rows: dict[str, list[Sample]], place: _Place | None) -> float | None:
    """Of the rows of this tick; None: none came, or one of them has no value."""
    if place is None or place[0] not in rows:
        return None
    mean = fmean(sample.values[place[1]] for sample in rows[place[0]])
    return None if isnan(mean) else mean


def _listed(names: list[str]) -> str:
    return ", ".join(names[:-1]) + " and " + names[-1] if len(names) > 1 else names[0]
