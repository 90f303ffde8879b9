"""Means over a constant command: blocks of a tenth of a second, once motor, water and amplifier have settled."""

from __future__ import annotations

from collections import deque

from rig.safety.consistency.look import RATE, THRUST, Look, Means

SETTLE = 0.7
"""s from the last change of the command; a lag of 0.3 s has then a tenth of its step left."""
REST_SETTLE = 2.5
"""s at 0 V without a rotation rate until the propeller is taken to rest."""
LONGEST_COAST = 4.0
"""s at 0 V after which a propeller that turns is taken to be turned by the water."""
BLOCK = 0.1
"""s"""
WINDOW = 3
"""Blocks that a mean is taken of: 0.3 s."""
KEPT = 3 * WINDOW
"""Blocks: the newest window, the one before it, and the oldest, which the newest is compared with."""
MOVING, NOISE = 0.03, 3.0
"""Share of a value, and times the mean step between blocks, by which what has settled may differ 0.2 s later."""
SAME = 1e-6
"""V: two commands that are no further apart are one."""

BEND = 3.0**0.5
"""Of white noise a second difference is so many times a first one, which a rotor that gathers speed would spoil."""


class Hold:
    """The blocks of the present command. `noise`: of a block, per channel, over all holds."""

    def __init__(self, rest_rate: float) -> None:
        self._rest_rate = rest_rate
        self.command: float | None = None
        self._driven = False
        self.blocks: deque[Means] = deque(maxlen=KEPT)
        self.count = 0
        """Blocks of this hold."""
        self._begun = self._settled_from = self._block_end = 0.0
        self._sums, self._counts = [0.0] * 3, [0] * 3
        self._steps, self._step_counts = [0.0] * 3, [0] * 3

    def advance(self, look: Look) -> bool:
        """True when a block was completed."""
        if look.command is None or self.command is None or abs(look.command - self.command) > SAME:
            self._begin(look)
            return False
        if look.command == 0.0 and not self.count and self._turns(look) and look.time < self._begun + LONGEST_COAST:
            self._settle_from(look.time + SETTLE)  # a propeller that coasts is not at rest
        if look.time < self._settled_from:
            return False
        self._add((look.rate, look.current, look.thrust))
        if look.time < self._block_end:
            return False
        self._end_block()
        return True

    @property
    def window(self) -> Means | None:
        """Of the newest blocks; None before there are enough."""
        return self._mean(-WINDOW, None) if self.count >= WINDOW else None

    @property
    def windows(self) -> tuple[Means, Means, Means] | None:
        """Three in a row, newest last."""
        if self.count < KEPT:
            return None
        return self._mean(0, WINDOW), self._mean(WINDOW, 2 * WINDOW), self._mean(2 * WINDOW, KEPT)

    def steady(self, zero: float) -> bool:
        """Rotation and thrust (less its `zero`, N) no longer move: no rotor that still gathers speed."""
        newest, before = self._mean(-2, None), self._mean(-4, -2)
        judged = ((RATE, 0.0), (THRUST, zero)) if self.command else ((THRUST, zero),)  # what is at rest may coast out
        for i, base in judged:
            new, old, noise = newest[i], before[i], self.noise(i)
            if new is not None and old is not None and noise is not None:
                allowed = max(MOVING * abs(new - base), NOISE * noise)
                if abs(new - old) > allowed:
                    return False
        return True

    def noise(self, channel: int) -> float | None:
        """Mean step between two blocks by their noise; None while too few were seen."""
        count = self._step_counts[channel]
        return self._steps[channel] / count if count >= WINDOW else None

    def _begin(self, look: Look) -> None:
        self.command, self._begun = look.command, look.time
        self.blocks.clear()
        self.count = 0
        self._driven = self._driven or bool(look.command)
        unknown = look.command == 0.0 and look.rate is None
        coasts = REST_SETTLE if self._driven else 0.0  # what nothing has driven yet is at rest
        self._settle_from(look.time + (coasts if unknown else SETTLE))

    def _settle_from(self, time: float) -> None:
        self._settled_from, self._block_end = time, time + BLOCK
        self._sums, self._counts = [0.0] * 3, [0] * 3

    def _turns(self, look: Look) -> bool:
        return look.rate is not None and abs(look.rate) > self._rest_rate

    def _add(self, values: tuple[float | None, ...]) -> None:
        for i, value in enumerate(values):
            if value is not None:
                self._sums[i] += value
                self._counts[i] += 1

    def _end_block(self) -> None:
        means = (s / n if n else None for s, n in zip(self._sums, self._counts, strict=True))
        block = Means(*means)
        if len(self.blocks) > 1:
            for i, (new, old, older) in enumerate(zip(block, self.blocks[-1], self.blocks[-2], strict=True)):
                if new is not None and old is not None and older is not None:
                    self._steps[i] += abs(new - 2.0 * old + older) / BEND
                    self._step_counts[i] += 1
        self.blocks.append(block)
        self.count += 1
        self._settle_from(self._block_end)

    def _mean(self, begin: int, end: int | None) -> Means:
        blocks = list(self.blocks)[begin:end]
        return Means(*(_mean_of([block[i] for block in blocks]) for i in range(3)))


def _mean_of(values: list[float | None]) -> float | None:
    """None where less than two blocks have a value: a slow sensor is not judged by one row."""
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if len(known) > 1 else None
