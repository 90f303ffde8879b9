"""Lines in the reading of the load cell (stage `cell`, in N): of the mains, and of the rotor."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from sim_devices.world.effects.stage import Floats, Stage, require_positive
from sim_devices.world.history import History
from sim_devices.world.state import State


@dataclass(slots=True)
class PeriodicDisturbance:
    """With `frequency` pick-up of one size, + amplitude sin(2 pi p + phase) with p' = frequency.

    That of the mains has 50 or 60 Hz (IEC 60196) and their multiples.

    With `blades` a force of the rotor, p' = blades |n|, that grows as n^2 and then meets the stand: imbalance m e (2
    pi n)^2 at once per turn, blade pass b rho n^2 D^4 at z n (Carlton 2007, Marine Propellers and Propulsion),
    so + amplitude (n / n_ref)^2 |H| sin(2 pi p + phase + arg H), n_ref = k reference_voltage. H is what a mass on a
    spring makes of a force of blades |n| Hz, settled: of `resonance` and `damping` where given, else of the world's
    `stand_resonance`; 1 on a rigid stand.
    """

    stage: ClassVar[Stage] = "cell"
    amplitude: float
    """N; with blades at reference_voltage, on a rigid stand."""
    frequency: float = 0.0
    """Hz; not used with blades."""
    blades: int = 0
    phase: float = 0.0
    """rad."""
    reference_voltage: float = 12.0
    """V; with blades."""
    resonance: float = 0.0
    """Hz of the stand for this force; with blades."""
    damping: float = 0.05
    """relative to critical; with `resonance`."""
    turns: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        if (self.frequency > 0) == (self.blades > 0):
            raise ValueError("give either frequency (Hz) or blades, not both and not neither")
        require_positive(reference_voltage=self.reference_voltage, damping=self.damping)

    def apply(self, value: float, s: State, dt: float) -> float:
        speed = self.blades * abs(s.n) if self.blades else self.frequency
        self.turns = (self.turns + speed * dt) % 1.0
        angle = 2.0 * pi * self.turns + self.phase
        return value + float(self._wave(np.asarray(angle), np.asarray(abs(s.n)), s))

    def over(self, value: Floats, h: History) -> Floats:
        n = np.abs(h.n)
        if self.blades:
            angle = 2.0 * pi * np.cumsum(self.blades * n) * h.dt + self.phase
        else:
            angle = 2.0 * pi * self.frequency * h.t + self.phase
        return np.asarray(value + self._wave(angle, n, h))

    def _wave(self, angle: Floats, n: Floats, s: State | History) -> Floats:
        if not self.blades:
            return np.asarray(self.amplitude * np.sin(angle))
        force = self.amplitude * (n / (s.rate_per_volt * self.reference_voltage)) ** 2
        answer = self._answer(self.blades * n, s)
        return np.asarray(force * np.abs(answer) * np.sin(angle + np.angle(answer)))

    def _answer(self, frequency: Floats, s: State | History) -> NDArray[np.complex128]:
        """H at each frequency (Hz)."""
        natural = self.resonance or s.stand_frequency
        if not natural:
            return np.ones(frequency.shape, dtype=np.complex128)
        ratio = frequency / natural
        damping = self.damping if self.resonance else s.stand_damping
        return np.asarray(1.0 / (1.0 - ratio**2 + 2j * damping * ratio), dtype=np.complex128)
