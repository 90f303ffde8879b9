"""Effects between the motor's terminals and its back-EMF (stage `motor`, in V): copper and magnets, cold and hot."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import copysign, sqrt
from typing import ClassVar

import numpy as np

from sim_devices.world.effects.stage import Floats, Stage, require_choice, require_positive
from sim_devices.world.filters import low_pass
from sim_devices.world.history import History
from sim_devices.world.state import State

COPPER = 0.0039
"""1/K: resistance of copper (IEC 60028: 0.00393 at 20 degC)."""
NEODYMIUM = 0.0011
"""1/K: remanence of NdFeB magnets falls by 0.1 to 0.12 % per K; ferrite 0.2 %, samarium cobalt 0.03 to 0.05 %."""


@dataclass(slots=True)
class WindingResistance:
    """Voltage lost in the winding: |V| = |n|/k + R I(n) with I = alpha n^2 / b, so V_eff = n/k solves a quadratic.

    form "linearised": V (1 - loss |V|), the same to first order, never below zero.
    """

    stage: ClassVar[Stage] = "motor"
    resistance: float
    """ohm."""
    form: str = "balance"

    def __post_init__(self) -> None:
        require_positive(resistance=self.resistance)
        require_choice("form", self.form, ("balance", "linearised"))

    def apply(self, value: float, s: State, _dt: float) -> float:
        loss = s.series_loss = self._loss(s)
        if self.form == "linearised":
            return value * max(1.0 - loss * abs(value), 0.0)
        return copysign((sqrt(1.0 + 4.0 * loss * abs(value)) - 1.0) / (2.0 * loss), value)

    def over(self, value: Floats, h: History) -> Floats:
        loss = h.series_loss = self._loss(h)
        if self.form == "linearised":
            return np.asarray(value * np.maximum(1.0 - loss * np.abs(value), 0.0))
        return np.asarray(np.sign(value) * (np.sqrt(1.0 + 4.0 * loss * np.abs(value)) - 1.0) / (2.0 * loss))

    def _loss(self, s: State | History) -> float:
        """1/V, of V = e + loss e^2."""
        return self.resistance * s.drag * s.rate_per_volt**2 / s.torque_acceleration


@dataclass(slots=True)
class Heating:
    """A motor that warms, fed with a voltage: V = k_e (1 - magnet dT_m) n + R (1 + copper dT_w) I.

    The propeller asks for the torque alpha n^2, and weaker magnets take more current for it: I = alpha n^2 / (b (1 -
    magnet dT_m)). So hot copper slows the rotor, in proportion to the share of the voltage that it takes, and hot
    magnets let it turn faster (Pyrhonen, Jokinen and Hrabovcova 2008 for the coefficients; the rest is the balance).
    With a fifth of V_max lost in the cold winding, copper 40 K warmer costs 4.9 % of the thrust there and 0.9 % at a
    tenth of it.

    What comes in is the back-EMF of the cold motor at these terminals, after `winding_resistance` where there is one:
    that is then all that is in series, of which `resistance` is what warms; where there is none, the drive makes up
    for the cold drop, and cold thrust is C V|V|. form "winding": copper warms
    as the motor's thermometer sees it, magnets stay in the water. form "magnet": magnets follow with a lag of their
    own, `time_constant`, and the winding has no resistance to speak of. form "both": both do.
    """

    stage: ClassVar[Stage] = "motor"
    resistance: float = 0.0
    """ohm, of the cold winding."""
    magnet: float = 0.0
    """1/K, of the remanence; not used by "winding"."""
    form: str = "winding"
    copper: float = COPPER
    """1/K; not used by "magnet"."""
    time_constant: float = 60.0
    """s, of the magnets."""
    rise: float = field(init=False, default=0.0)
    """K, of the magnets."""

    def __post_init__(self) -> None:
        require_choice("form", self.form, ("winding", "magnet", "both"))
        require_positive(time_constant=self.time_constant)
        if self.form != "magnet":
            require_positive(resistance=self.resistance)
        if self.form != "winding":
            require_positive(magnet=self.magnet)

    def apply(self, value: float, s: State, dt: float) -> float:
        self.rise += (s.motor_rise - self.rise) * min(dt / self.time_constant, 1.0)
        s.flux = float(self._flux(np.asarray(self.rise)))
        hot = self._hot(np.asarray(abs(value)), np.asarray(s.motor_rise), np.asarray(s.flux), s)
        return copysign(float(hot), value)

    def over(self, value: Floats, h: History) -> Floats:
        """`h.motor_rise` is that of the pass before: the sweep passes here until it stands still."""
        h.flux = self._flux(low_pass(h.motor_rise, self.time_constant, h.dt))
        return np.asarray(np.copysign(self._hot(np.abs(value), h.motor_rise, h.flux, h), value))

    def _flux(self, rise: Floats) -> Floats:
        """Of the magnets, of what they have when cold; never all of it lost."""
        return np.ones_like(rise) if self.form == "winding" else np.maximum(1.0 - self.magnet * rise, LEAST_FLUX)

    def _hot(self, cold: Floats, rise: Floats, flux: Floats, s: State | History) -> Floats:
        """Back-EMF in volts of the cold motor, n/k: flux e + ((loss + hotter) / flux) e^2 = cold + loss cold^2."""
        own = self._loss(s)
        loss = s.series_loss or own
        bend = (loss + own * self.copper * rise) / flux
        terminals = cold + loss * cold * cold
        return np.asarray(2.0 * terminals / (flux + np.sqrt(flux * flux + 4.0 * bend * terminals)))

    def _loss(self, s: State | History) -> float:
        """1/V, of the cold winding that warms: V = e + loss e^2."""
        resistance = 0.0 if self.form == "magnet" else self.resistance
        return resistance * s.drag * s.rate_per_volt**2 / s.torque_acceleration


LEAST_FLUX = 0.2
"""Magnets that hot are lost for good: below it the world would not be one."""
