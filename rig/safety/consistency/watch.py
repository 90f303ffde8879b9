"""Command against rotation against current against thrust, tick by tick: learnt in the proof and at the first levels,
watched from then on.
"""

from __future__ import annotations

from rig.safety.consistency.delay import SIGMAS as DELAY_SIGMAS
from rig.safety.consistency.delay import SMALL as DELAY_SMALL
from rig.safety.consistency.delay import Way
from rig.safety.consistency.hold import WINDOW, Hold
from rig.safety.consistency.jump import Jump
from rig.safety.consistency.learnt import doubts, factors
from rig.safety.consistency.levels import Level, Levels
from rig.safety.consistency.look import Look, Means

ARRIVED = WINDOW + 1
"""Blocks of a hold after which its level is judged: 1.1 s after the command last moved."""
LATE_STEPS = 2
"""In a row that come too late."""


class Consistency:
    """One run of one thruster. Rates in rev/s, `max_voltage` in V."""

    def __init__(self, rest_rate: float, max_voltage: float) -> None:
        self._hold, self._jump, self._way = Hold(rest_rate), Jump(), Way()
        self._levels = Levels(max_voltage)
        self._level: Level | None = None
        """Of the present hold, once it has settled and was believed."""
        self._before: Level | None = None
        """Of the hold before."""
        self._zero: float | None = None
        self._late_steps = 0
        self.delays: list[float] = []
        """s that the thrust came after the rotation, of every step that could be judged."""

    def advance(self, look: Look) -> str:
        """Empty, or one clause: what does not fit."""
        moved = self._hold.command is not None and look.command != self._hold.command
        if moved:
            self._leave()
        block = self._hold.advance(look)
        self._way.add(look)
        if not block or self._hold.count < ARRIVED:
            return ""
        return self._settled(look.flowing)

    def told(self) -> str:
        """The factors learnt so far."""
        return factors(self._levels.known.values(), self.delays)

    def doubts(self, expected_C: float | None) -> list[str]:
        """What an analyst should look at, of the whole run."""
        return doubts(self._levels.known.values(), expected_C)

    def _leave(self) -> None:
        if self._level is not None:
            self._levels.keep(self._level)
            if self._level.volts == 0.0:
                self._zero = self._level.means.thrust
            self._before, self._level = self._level, None
        self._jump = Jump()

    def _settled(self, flowing: bool) -> str:
        """One more block of a hold that has settled."""
        window, hold = self._hold.window, self._hold
        assert window is not None
        assert hold.command is not None
        level = Level(hold.command, window, self._zero, Means(hold.noise(0), hold.noise(1), hold.noise(2)))
        cause = ""
        if self._level is None and hold.steady(self._zero or 0.0):
            cause = self._levels.judge(level, flowing=flowing) or self._too_late(level)
            self._level = level
        if hold.windows is not None and not cause:
            cause = self._jump.advance(hold.windows, self._zero, self._levels.largest, hold.noise)
        if self._level is not None:
            self._way.clear()
            self._level = level
        return cause

    def _too_late(self, after: Level) -> str:
        """Of the way from the hold before to this one."""
        before = self._before
        if before is None or self._zero is None:
            return ""
        size = self._levels.largest or abs(after.push or 0.0)
        least = max(DELAY_SIGMAS * (after.noise.thrust or 0.0), DELAY_SMALL * size)
        late = self._way.late(before.means, after.means, self._zero, least)
        if late is None:
            return ""
        self.delays.append(late.seconds)
        self._late_steps = self._late_steps + 1 if late.wrong else 0
        return str(late) if self._late_steps >= LATE_STEPS else ""
