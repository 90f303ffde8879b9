"""Viscoelastic cell: F + c lowpass(F), over tens of seconds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from identification.physics.filters import lowpass
from identification.physics.term import Moment, Parameter, Scale, Stage
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class LoadCellCreep:
    """Viscoelastic cell: F + c lowpass(F), over tens of seconds."""

    id: ClassVar[str] = "load_cell_creep"
    stage: ClassVar[Stage] = "cell"
    physics: ClassVar[str] = "the load cell creeps under load"
    needs: ClassVar[tuple[str, ...]] = ()
    coordinates: ClassVar[tuple[str, ...]] = ("time_since_step", "time")
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("share", "1", -0.5, 0.5, 0.0), Parameter("time_constant", "s", 1.0, 600.0))

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return tuple((0.02, tau) for tau in (3.0, 10.0, 30.0, 100.0))

    def apply(self, value: Floats, now: Moment, theta: tuple[float, ...]) -> Floats:
        out: Floats = value + theta[0] * lowpass(value, now.history.dt, theta[1])[1]
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return f"Load-cell creep: {100 * theta[0]:.2g} % of the load comes late, with a time constant of {theta[1]:.3g} s, and leaves late."


FORMS = (LoadCellCreep(),)
