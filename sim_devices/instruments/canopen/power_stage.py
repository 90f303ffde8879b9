"""What a simulated CiA 402 drive does to its motor: a ramp of speed, a loop around it, a torque, or nothing."""

from __future__ import annotations

from collections.abc import Callable
from math import copysign

PROPORTIONAL = 4.0
"""V beyond what the wanted speed takes, for each V that the speed lacks."""
INTEGRAL = 20.0
"""The same per s."""
STANDING = 0.2
"""rev/s: slower than this a quick stop is over."""


class PowerStage:
    """`gain`: rev/s of the thruster for 1 V; the drive has learnt its motor."""

    def __init__(self, gain: Callable[[], float], supply: float) -> None:
        self._gain, self._supply = gain, supply
        self.ramp = 0.0
        """rev/s that the loop follows now."""
        self._integral = 0.0

    def begin(self, n: float) -> None:
        """Take hold of a motor that turns at n (rev/s)."""
        self.ramp, self._integral = n, 0.0

    def follow(self, target: float, slope: float, n: float, dt: float) -> float:
        """V for one step of the loop at n, on the way to `target` by `slope` (rev/s, rev/s^2)."""
        step = slope * dt
        self.ramp = min(max(target, self.ramp - step), self.ramp + step)
        lack = (self.ramp - n) / self._gain()
        wanted = self.ramp / self._gain() + PROPORTIONAL * lack + self._integral
        if abs(wanted) <= self._supply:
            self._integral += INTEGRAL * lack * dt
            return wanted
        return copysign(self._supply, wanted)

    def stands(self, n: float) -> bool:
        """A ramp to 0 has ended, and the rotor with it."""
        return self.ramp == 0.0 and abs(n) < STANDING
