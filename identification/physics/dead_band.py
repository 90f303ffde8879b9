"""Static friction or the neutral zone of a drive: nothing happens below a voltage."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np

from identification.physics.term import Moment, Parameter, Scale, Stage
from identification.recording import Floats

EDGE = 2e-3
"""Of the largest command: a ramp this narrow keeps the prediction of a jump continuous in the parameter."""


@dataclass(frozen=True, slots=True)
class DeadBand:
    """Static friction or the neutral zone of a drive: nothing happens below a voltage."""

    id: ClassVar[str] = "dead_band"
    stage: ClassVar[Stage] = "command"
    physics: ClassVar[str] = "below a voltage the rotor does not turn"
    needs: ClassVar[tuple[str, ...]] = ()
    coordinates: ClassVar[tuple[str, ...]] = ("command_voltage",)
    form: Literal["shrink", "jump"] = "shrink"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        known = Parameter("half_width", scale.driver_unit, 0.0, 0.6 * scale.driver, 0.0)
        return (replace(known, jumps=True, blur=EDGE * scale.driver) if self.form == "jump" else known,)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return tuple((share * scale.driver,) for share in (0.01, 0.03, 0.07, 0.15, 0.3))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        if self.form == "shrink":
            return ()
        # a jump moves nothing between two levels: no slope leads from one to the next
        most = self.parameters(scale)[0].high
        return tuple((min(float(share) * values[0], most),) for share in np.geomspace(0.3, 3.0, 48))

    def apply(self, value: Floats, now: Moment, theta: tuple[float, ...]) -> Floats:
        size = np.abs(value)
        if self.form == "jump":
            # a command that moves within an interval passes the threshold in a part of it; its variance tells how far
            moved = np.sqrt(12 * np.abs(now.history.excess))
            edge = np.maximum(EDGE * now.scale.driver, moved)
            out: Floats = value * np.clip((size - theta[0]) / edge + 0.5, 0.0, 1.0) if theta[0] > 0 else value
            return out
        shrunk: Floats = np.sign(value) * np.maximum(size - theta[0], 0.0)
        return shrunk

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        what = "thrust begins with a jump" if self.form == "jump" else "only the voltage beyond it acts"
        return f"Dead band: within +-{theta[0]:.3g} {scale.driver_unit} the rotor does not turn, and {what}."


FORMS = (
    DeadBand("shrink"),
    DeadBand("jump"),
)
