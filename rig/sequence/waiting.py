"""A wait at 0 V, for the water to settle and a motor to cool, with what is left of it. Pure: time is given."""

from __future__ import annotations

from typing import Literal

from rig.campaign.waits import CoolDown, Wait
from rig.sequence.ticks import EPSILON

COOL_FOR = 1.0
"""s below the limit without a break: one value alone may be a wire's."""


class Waiting:
    """The wait of one step from `start` s on."""

    def __init__(self, start: float, wait: Wait) -> None:
        self._start, self._wait = start, wait
        self._cool_since: float | None = None
        self._temperature: float | None = None

    def advance(self, time: float, temperature: float | None) -> Literal["waiting", "over", "failed"]:
        """`temperature`: degC, None when it is not known, which is never cool. `failed`: not cool in time."""
        self._temperature = temperature
        cool, elapsed = self._wait.cool, time - self._start + EPSILON
        if cool is not None and not self._cool_enough(cool, time):
            return "failed" if elapsed >= self._wait.bounds[1] else "waiting"
        return "over" if elapsed >= self._wait.water else "waiting"

    def _cool_enough(self, cool: CoolDown, time: float) -> bool:
        below = self._temperature is not None and self._temperature < cool.below
        if not below:
            self._cool_since = None
            return False
        self._cool_since = time if self._cool_since is None else self._cool_since
        return time - self._cool_since + EPSILON >= COOL_FOR

    def reason(self, time: float) -> str:
        """What it waits for and how long still, for people."""
        elapsed, cool = time - self._start, self._wait.cool
        water = self._wait.water - elapsed
        told = [f"water settles: {_left(water)} left"] if water > 0.0 else []
        if cool is not None and (self._cool_since is None or time - self._cool_since < COOL_FOR):
            most = _left(self._wait.bounds[1] - elapsed)
            told.append(f"{self._measured(cool)}, goes on below {cool.below:g} °C, at most {most} more")
        return "; ".join(told)

    @property
    def found(self) -> str:
        """The temperature at the end of a cool-down."""
        return f": {self._measured(self._wait.cool)}" if self._wait.cool is not None else ""

    def failure(self, time: float) -> str:
        """Why it cannot go on."""
        cool = self._wait.cool
        assert cool is not None
        return (
            f"not cooled down: {self._measured(cool)} after {_left(time - self._start)} at 0 V, "
            f"and below {cool.below:g} °C was waited for"
        )

    def _measured(self, cool: CoolDown) -> str:
        name = cool.channel.rpartition(".")[2].replace("_", " ")
        return f"{name} {'unknown' if self._temperature is None else f'{self._temperature:.1f} °C'}"


def _left(seconds: float) -> str:
    """In words short enough for a line: `43 s`, `9 min`."""
    whole = max(0, round(seconds))
    return f"{whole} s" if whole < 120 else f"{whole / 60:.0f} min"
