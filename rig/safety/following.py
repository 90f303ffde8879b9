"""Does the propeller do what the motor is told? A motor that is off, has a fault of its own, starts by itself or runs
backwards ends the run. Judged by its rotation rate, within bounds wide enough for a sound bench. Pure: time is given.
"""

from __future__ import annotations

from dataclasses import dataclass

from rig.safety.guard import Trip
from rig.safety.stopping import REST_CONFIRM, is_rest
from rig.safety.watchdog_proof import TURNING

FOLLOW_TIME = 1.0
"""s at or above the proof's voltage until the propeller must have turned, counted over all such times since it last
did; and, of one sign, until it must turn the same way as before. A rotor in water follows within tenths of a second,
also through a reversal."""
START_TIME = 0.2
"""s at 0 V, after rest, in which it must turn to be taken for a start: ten status messages at 50 Hz."""


@dataclass
class _Since:
    """Since when something holds without a break."""

    start: float | None = None

    def held(self, holds: bool, now: float) -> float:
        """s; 0 while it does not hold."""
        if not holds:
            self.start = None
            return 0.0
        self.start = now if self.start is None else self.start
        return now - self.start


class Following:
    """One motor. `proof_voltage` (V) is what the bench file calls enough to turn the propeller."""

    def __init__(self, channel: str, proof_voltage: float, rest_rate: float) -> None:
        self._channel, self._proof_voltage, self._rest_rate = channel, proof_voltage, rest_rate
        self._way = 0.0
        """Sign of rate over voltage when it first followed; a motor may be wired either way round."""
        self._last_way = 0.0
        self._still = 0.0
        """s driven since it last turned."""
        self._last = 0.0
        self._driven, self._wrong, self._right = _Since(), _Since(), _Since()
        self._rest, self._start = _Since(), _Since()
        self._rested = False

    def advance(self, now: float, command: float | None, rate: float | None) -> Trip | None:
        """`command`: V since the last tick, None while nothing is sent (the watchdog's proof).

        `rate`: rev/s, None: unknown, which the guard judges.
        """
        dt, self._last = now - self._last if self._last else 0.0, now
        if rate is None:
            return None
        at_rest, turns = is_rest(rate, self._rest_rate), abs(rate) > TURNING * self._rest_rate
        cause = self._not_following(now, dt, command or 0.0, rate, at_rest, turns)
        cause = cause or self._by_itself(now, command, rate, at_rest, turns)
        return Trip(cause, "following", now, self._channel, rate) if cause else None

    def _not_following(self, now: float, dt: float, command: float, rate: float, at_rest: bool, turns: bool) -> str:
        way = (command > 0) - (command < 0)
        enough = abs(command) >= self._proof_voltage and way == self._last_way
        self._last_way = way
        driven = self._driven.held(enough, now)
        self._still = self._still + dt * enough if at_rest else 0.0
        if self._still >= FOLLOW_TIME:
            return (
                f"the motor does not follow: {rate:.2f} rev/s after {self._still:.1f} s of driving, where "
                f"{self._proof_voltage:g} V (bench.proof_voltage) are enough to turn the propeller; it is off, has a "
                "fault, is blocked, or its telemetry is frozen"
            )
        if not enough or not turns:
            self._wrong.held(False, now)
            self._right.held(False, now)
            return ""
        found = way * (1.0 if rate > 0 else -1.0)
        if not self._way:
            self._way = found if self._right.held(True, now) >= FOLLOW_TIME else 0.0
        elif self._wrong.held(found != self._way, now) >= FOLLOW_TIME:
            return f"the propeller runs backwards: {rate:.2f} rev/s after {driven:.1f} s at {command:.3g} V"
        return ""

    def _by_itself(self, now: float, command: float | None, rate: float, at_rest: bool, turns: bool) -> str:
        """Only after rest at 0 V: in flowing water a propeller may never come to rest."""
        if command != 0.0:
            self._rested = False
        self._rested = self._rested or self._rest.held(command == 0.0 and at_rest, now) >= REST_CONFIRM
        if self._start.held(self._rested and turns, now) < START_TIME:
            return ""
        return f"the propeller turns by itself: {rate:.2f} rev/s at command 0 V, after it had been at rest"
