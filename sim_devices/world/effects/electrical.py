"""Effects between the command and the voltage the rotor answers to (stage `command`, in V)."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import copysign, tanh
from typing import ClassVar

import numpy as np

from sim_devices.world.effects.stage import Floats, Stage, require_choice, require_positive
from sim_devices.world.filters import low_pass
from sim_devices.world.history import History
from sim_devices.world.state import State

OUTPUT_CAPACITOR = 0.02
"""s: the supply's output capacitor, so that current and voltage do not chase each other step by step."""


@dataclass(slots=True)
class SupplySag:
    """The command is a fraction of a supply that moves: V_eff = V (V_bus / V_nom)^exponent.

    V_bus = V_nom - source_resistance * I_in - discharge * charge drawn, from `start` on. The drive switches: power is
    the same on both of its sides, so I_in = D I with the duty D = V_eff / V_bus, and the motor sees the source as
    D^2 source_resistance in series. With I ~ V^2 the relative loss goes as V^3, that of a winding as V: at half the
    voltage an eighth against a half (power balance of an ideal buck converter, Mohan, Undeland and Robbins 1995).
    """

    stage: ClassVar[Stage] = "command"
    source_resistance: float = 0.0
    """ohm."""
    discharge: float = 0.0
    """V/(A.s)."""
    exponent: float = 1.0
    start: float = 0.0
    """s of world time: until then the supply is stiff."""
    charge: float = field(init=False, default=0.0)
    """A.s drawn since `start`."""

    def apply(self, value: float, s: State, dt: float) -> float:
        current = s.input_current if s.t >= self.start else 0.0
        self.charge += current * dt
        sagged = s.nominal_bus - self.source_resistance * current - self.discharge * self.charge
        s.bus_voltage += (sagged - s.bus_voltage) * min(dt / OUTPUT_CAPACITOR, 1.0)
        return float(value * (max(s.bus_voltage, 0.0) / s.nominal_bus) ** self.exponent)

    def over(self, value: Floats, h: History) -> Floats:
        """`h.input_current` is that of the pass before: the sweep passes here until it stands still."""
        current = np.where(h.t >= self.start, h.input_current, 0.0)
        charge = np.cumsum(current) * h.dt
        sagged = h.nominal_bus - self.source_resistance * current - self.discharge * charge
        h.bus_voltage = h.nominal_bus + low_pass(sagged - h.nominal_bus, OUTPUT_CAPACITOR, h.dt)
        return np.asarray(value * (np.maximum(h.bus_voltage, 0.0) / h.nominal_bus) ** self.exponent)


@dataclass(slots=True)
class DeadBand:
    """Static friction or the neutral zone of a drive.

    form "shrink": V_eff = sgn(V) max(|V| - half_width, 0); form "jump": V_eff = V where |V| >= half_width, else 0;
    form "smooth": V - half_width tanh(V/half_width), friction that gives way little by little.
    """

    stage: ClassVar[Stage] = "command"
    half_width: float
    """V."""
    form: str = "shrink"

    def __post_init__(self) -> None:
        require_positive(half_width=self.half_width)
        require_choice("form", self.form, ("shrink", "jump", "smooth"))

    def apply(self, value: float, _s: State, _dt: float) -> float:
        if self.form == "smooth":
            return value - self.half_width * tanh(value / self.half_width)
        size = abs(value)
        if size < self.half_width:
            return 0.0
        return value if self.form == "jump" else copysign(size - self.half_width, value)

    def over(self, value: Floats, _h: History) -> Floats:
        if self.form == "smooth":
            return np.asarray(value - self.half_width * np.tanh(value / self.half_width))
        size = np.abs(value)
        if self.form == "jump":
            return np.where(size < self.half_width, 0.0, value)
        return np.asarray(np.sign(value) * np.maximum(size - self.half_width, 0.0))
