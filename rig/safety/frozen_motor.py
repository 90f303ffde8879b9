"""Does the motor's telemetry live? A controller whose measurements hang sends rows that are young, whole and old news.

Judged are whole rows (rotation rate, current and whatever comes with them), while the motor is driven and the newest
row says that it turns. Pure: time is given.
"""

from __future__ import annotations

from dataclasses import dataclass

from drivers.protocols import Sample
from rig.safety.guard import Trip

Row = tuple[float, ...]

LEAST_ROWS = 4
"""Equal rows in a row that are still chance."""
LEAST_TIME = 0.1
"""s, the same for a stream that is faster than 40 rows/s."""
MOVED = 0.1
"""Of the bench's largest voltage: a command that has moved so far must show in rate or current."""
NOISE_TIME = 1.0
"""s, shortest time without any change that is taken for noise that vanished."""
REVERSALS = 20
"""A channel goes up and then down, or down and then up: so often that must have been seen before noise is expected
(what merely settles does not turn back); and so many times the mean distance of two may pass without a change."""
STANDSTILLS = 5.0
"""Times the longest standstill of whole rows so far."""


@dataclass(frozen=True, slots=True)
class MotorRows:
    """Where the motor's rate and current stand in its rows."""

    stream: str
    period_s: float
    rate: int
    """Column of the rotation rate."""
    current: int | None
    current_limit: float | None
    """A"""
    rest_rate: float
    """rev/s"""
    max_voltage: float
    """V"""


class FrozenMotor:
    """The rows of one motor controller and the commands it was sent meanwhile."""

    def __init__(self, rows: MotorRows) -> None:
        self._rows = rows
        self._row: Row = ()
        self._slopes: list[int] = []
        self._changed_ns = self._newest_ns = 0
        self._repeats = 0
        self._command = 0.0
        """V, when the row last changed."""
        self._reversals = 0
        self._turned = self._longest = 0.0
        """s turning while driven; s, longest standstill that ended."""
        self.trip: Trip | None = None
        """Stays until a row differs: what says "at rest" meanwhile is not believed."""

    def advance(self, samples: tuple[Sample, ...], command: float, now: float) -> Trip | None:
        """`command`: V, sent before these rows came. 0 V is never judged, for at rest a row may well repeat itself."""
        for sample in samples:
            if sample.stream == self._rows.stream:
                self._take(sample, command)
        if self.trip is None and command != 0.0 and self._row and self._turns():
            cause = self._moved(command) or self._over_current(command) or self._noiseless()
            if cause:
                what = f"the telemetry of {self._rows.stream} is frozen: {cause}; rate and current are not known"
                self.trip = Trip(what, "frozen", now, self._rows.stream)
        return self.trip

    def doubt(self, trip: Trip) -> None:
        """The propeller does not do what it is told: rows that have stood still all the while are not believed."""
        if self._same >= NOISE_TIME:
            self.trip = self.trip or trip

    def _turns(self) -> bool:
        return abs(self._row[self._rows.rate]) > self._rows.rest_rate

    @property
    def _same(self) -> float:
        """For how many s the very same row came."""
        return (self._newest_ns - self._changed_ns) * 1e-9

    def _take(self, sample: Sample, command: float) -> None:
        lived = bool(self._row) and command != 0.0 and self._turns()
        if lived:
            self._turned += (sample.t_ns - self._newest_ns) * 1e-9
        self._newest_ns = sample.t_ns
        if sample.values == self._row:
            self._repeats += 1
            return
        if lived:
            self._longest = max(self._longest, (sample.t_ns - self._changed_ns) * 1e-9)
        self._note_reversals(sample.values, lived)
        self._row, self._changed_ns, self._repeats = sample.values, sample.t_ns, 0
        self._command, self.trip = command, None

    def _note_reversals(self, row: Row, lived: bool) -> None:
        slopes = [(new > old) - (new < old) for new, old in zip(row, self._row or row, strict=True)]
        turned = any(a * b < 0 for a, b in zip(slopes, self._slopes, strict=False))
        self._reversals += lived and turned
        self._slopes = [a or b for a, b in zip(slopes, self._slopes or slopes, strict=True)]

    def _moved(self, command: float) -> str:
        far = abs(command - self._command)
        shortest = max(LEAST_ROWS * self._rows.period_s, LEAST_TIME)
        if far < MOVED * self._rows.max_voltage or self._repeats < LEAST_ROWS or self._same < shortest:
            return ""
        return f"not one value has changed for {self._same:.2f} s, while the command moved by {far:.2g} V"

    def _over_current(self, command: float) -> str:
        """The current of a propeller goes at least with the square of its voltage (quadratic torque, n ~ V)."""
        rows = self._rows
        if rows.current is None or rows.current_limit is None or not self._command or self._repeats < LEAST_ROWS - 1:
            return ""
        most = abs(self._row[rows.current]) * max(command / self._command, 1.0) ** 2
        if most <= rows.current_limit:
            return ""
        return f"it says the same for {self._same:.2f} s; by the command the current may be {most:.3g} A by now"

    def _noiseless(self) -> str:
        if self._reversals < REVERSALS:
            return ""
        mean = self._turned / self._reversals
        limit = max(NOISE_TIME, REVERSALS * mean, STANDSTILLS * self._longest)
        if self._same <= limit:
            return ""
        return f"not one value has changed for {self._same:.2f} s, its noise allows {limit:.2g} s"
