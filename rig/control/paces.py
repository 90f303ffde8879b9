"""The pace of every stream that the guard judges, counted from the rows that came, and the way from row to row."""

from __future__ import annotations

from collections.abc import Iterable

from drivers.protocols import Sample, Stream
from rig.campaign.bench import Bench
from rig.campaign.limits import GuardedChannel
from rig.control.readings import Readings
from rig.safety.guard import Trip, Vitals
from rig.safety.pace import WINDOW, WINDOW_ROWS, Pace
from rig.safety.row_spacing import RowSpacing


class Paces:
    """Of the streams of `guarded` channels, from `now` s on."""

    def __init__(self, bench: Bench, readings: Readings, guarded: Iterable[GuardedChannel], now: float) -> None:
        judged = {readings.place[one.channel][0] for one in guarded}
        self._readings = readings
        streams = [(device, stream) for device, stream in bench.streams() if stream.name in judged]
        self._paces: dict[str, Pace] = {}
        self._spacings: dict[str, RowSpacing] = {}
        for device, stream in streams:
            self._begin(device, stream, now)
        self._with_commands = [(device, stream) for device, stream in streams if stream.with_commands]
        self._counted = dict(readings.rows)

    def _begin(self, device: str, stream: Stream, now: float) -> None:
        name, period = stream.name, stream.period_s
        self._paces[name] = Pace(name, device, period, now)
        self._spacings[name] = RowSpacing(name, period, max(WINDOW, WINDOW_ROWS * period), now)

    def advance(self, vitals: Vitals, samples: Iterable[Sample] = (), *, commanded: bool = True) -> Trip | None:
        """First stream that does not keep its pace, or None. `samples`: of this tick. `commanded` False: nothing was
        sent (the watchdog is being proved), and streams that come with commands begin anew."""
        trips = []
        for device, asked in () if commanded else self._with_commands:
            self._begin(device, asked, vitals.now)
        for sample in samples:
            if spacing := self._spacings.get(sample.stream):
                spacing.add(sample.t_ns * 1e-9, sample.values)
        for stream, pace in self._paces.items():
            rows = self._readings.rows.get(stream, 0)
            trips.append(pace.advance(rows - self._counted.get(stream, 0), vitals))
            trips.append(self._spacings[stream].advance(vitals.now))
            self._counted[stream] = rows
        return next((trip for trip in trips if trip), None)
