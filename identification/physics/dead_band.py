"""Static friction or the neutral zone of a drive: nothing happens below a voltage."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np

from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats
from identification.run_history.command_means import command_means

EDGE = 2e-4
"""Of the largest command: a ramp this narrow keeps the prediction of a jump continuous in the parameter."""
LEAST_MOVE = 1e-6
"""Of the largest command: what moves less within an interval stands still."""


@dataclass(frozen=True, slots=True)
class DeadBand:
    """Static friction or the neutral zone of a drive: nothing happens below a voltage."""

    id: ClassVar[str] = "dead_band"
    stage: ClassVar[Stage] = "command"
    physics: ClassVar[str] = "below a voltage the rotor does not turn"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("command_voltage",)
    traits: ClassVar[Traits] = Traits(
        spread=True, tick_by_tick=True, revealed_by="fine levels close to zero, of both signs"
    )
    form: Literal["shrink", "jump"] = "shrink"
    edge: float = EDGE
    """Of the largest command: over which a jump is spread."""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        known = Parameter("half_width", scale.driver_unit, 0.0, 0.6 * scale.driver, 0.0)
        return (replace(known, jumps=True, blur=self.edge * scale.driver) if self.form == "jump" else known,)

    def sharp(self) -> DeadBand:
        return replace(self, edge=LEAST_MOVE) if self.form == "jump" else self

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        # what one jump changes is not what another does, unless they are near
        shares = np.geomspace(0.01, 0.5, 22).tolist() if self.form == "jump" else (0.01, 0.03, 0.07, 0.15, 0.3)
        return tuple((share * scale.driver,) for share in shares)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        if self.form == "shrink":
            return ()
        # a jump moves nothing between two levels: no slope leads from one to the next
        most = self.parameters(scale)[0].high
        return tuple((min(float(share) * values[0], most),) for share in np.geomspace(0.3, 3.0, 48))

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        if theta[0] <= 0:
            return value
        history, least = now.history, (self.edge if self.form == "jump" else LEAST_MOVE) * now.scale.driver
        if value is history.driver and history.ticks is not None:
            return command_means(history, lambda each: self._mean(each, 0.5 * least, theta[0]))
        # what moves within an interval passes the threshold in a part of it; its variance tells how far
        return self._mean(value, 0.5 * np.maximum(least, np.sqrt(12 * np.abs(history.excess))), theta[0])

    def _mean(self, value: Floats, half: Floats | float, half_width: float) -> Floats:
        """(M,) of what acts of voltages that lie evenly within `half` of `value` (M,); to the last digit where all of
        them lie on one side of the threshold."""
        jumps, size = self.form == "jump", np.abs(value)
        total = _of_jump if jumps else _of_shrink
        out: Floats = (total(value + half, half_width) - total(value - half, half_width)) / (2 * half)
        out = np.where(size - half >= half_width, value if jumps else value - np.sign(value) * half_width, out)
        return np.where(size + half <= half_width, 0.0, out)

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        V, width = model.symbol, f"{theta[0]:.6g}"
        if self.form == "jump":
            return (f"{V} = where(abs({V}) < {width}, 0, {V})",)
        return (f"{V} = sign({V}) * maximum(abs({V}) - {width}, 0)",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        what = "thrust begins with a jump" if self.form == "jump" else "only the voltage beyond it acts"
        return f"Dead band: within +-{theta[0]:.3g} {scale.driver_unit} the rotor does not turn, and {what}."


def _of_jump(value: Floats, half_width: float) -> Floats:
    """(M,) integral of the voltage that acts, from 0 to `value`, where all of it does beyond the band."""
    out: Floats = 0.5 * np.maximum(value**2 - half_width**2, 0.0)
    return out


def _of_shrink(value: Floats, half_width: float) -> Floats:
    """The same where only what is beyond the band acts."""
    out: Floats = 0.5 * np.maximum(np.abs(value) - half_width, 0.0) ** 2
    return out


FORMS = (
    DeadBand("shrink"),
    DeadBand("jump"),
)
