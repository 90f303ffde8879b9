"""The pace of every stream that the guard judges, counted from the rows that came."""

from __future__ import annotations

from collections.abc import Iterable

from rig.campaign.bench import Bench
from rig.campaign.limits import GuardedChannel
from rig.control.readings import Readings
from rig.safety.guard import Trip, Vitals
from rig.safety.pace import Pace


class Paces:
    """Of the streams of `guarded` channels, from `now` s on."""

    def __init__(self, bench: Bench, readings: Readings, guarded: Iterable[GuardedChannel], now: float) -> None:
        judged = {readings.place[one.channel][0] for one in guarded}
        self._readings = readings
        self._paces = tuple(
            (stream.name, Pace(stream.name, device, stream.period_s, now))
            for device, stream in bench.streams()
            if stream.name in judged
        )
        self._counted = dict(readings.rows)

    def advance(self, vitals: Vitals) -> Trip | None:
        """First stream that does not keep its pace, or None."""
        trips = []
        for stream, pace in self._paces:
            rows = self._readings.rows.get(stream, 0)
            trips.append(pace.advance(rows - self._counted.get(stream, 0), vitals))
            self._counted[stream] = rows
        return next((trip for trip in trips if trip), None)
