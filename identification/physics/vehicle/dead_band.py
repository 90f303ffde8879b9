"""Dead band of a vehicle's thrusters: nothing happens below a voltage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from identification.physics.term import Parameter
from identification.physics.vehicle.term import Scale, Stage, Untouched, VehicleContext
from identification.recording import Floats

EDGE = 0.02
"""Of the largest voltage: the ramp that replaces the edge of a jump, so that a fit can move it."""


@dataclass(frozen=True, slots=True)
class DeadBand(Untouched):
    """Static friction or the neutral zone of the drives, the same in all thrusters."""

    id: ClassVar[str] = "dead_band"
    stage: ClassVar[Stage] = "command"
    physics: ClassVar[str] = "below a voltage the rotors do not turn"
    covariates: ClassVar[tuple[str, ...]] = ("command_voltage",)
    form: Literal["shrink", "jump"] = "shrink"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("half_width", "V", 0.0, 0.6 * scale.volts, 0.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return tuple((share * scale.volts,) for share in (0.02, 0.05, 0.1, 0.2, 0.35))

    def on_volts(self, volts: Floats, now: VehicleContext, theta: tuple[float, ...]) -> Floats:
        size = np.abs(volts)
        if self.form == "jump":
            out: Floats = volts * np.clip((size - theta[0]) / (EDGE * now.scale.volts) + 0.5, 0.0, 1.0)
            return out if theta[0] > 0 else volts
        shrunk: Floats = np.sign(volts) * np.maximum(size - theta[0], 0.0)
        return shrunk

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        what = "thrust begins with a jump" if self.form == "jump" else "only the voltage beyond it acts"
        return f"Dead band: within +-{theta[0]:.3g} V the thrusters do not turn, and {what}."


FORMS = (DeadBand("shrink"), DeadBand("jump"))
