"""The command is a fraction of a supply that moves: V_eff = V (V_bus / V_ref)^k, V_ref the highest of the run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.term import Moment, Parameter, Scale, Stage
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class SupplySag:
    """The command is a fraction of a supply that moves: V_eff = V (V_bus / V_ref)^k, V_ref the highest of the run."""

    id: ClassVar[str] = "supply_sag"
    stage: ClassVar[Stage] = "command"
    physics: ClassVar[str] = "the command is a fraction of a supply voltage that moves"
    needs: ClassVar[tuple[str, ...]] = ("bus_voltage",)
    coordinates: ClassVar[tuple[str, ...]] = ("bus_voltage",)
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("exponent", "1", 0.0, 3.0, 0.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.1,), (1.0,))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: Moment, theta: tuple[float, ...]) -> Floats:
        bus = now.history.others["bus_voltage"]
        ratio = np.maximum(bus / np.nanmax(bus), 1e-3)
        out: Floats = value * ratio ** theta[0]
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            "Supply sag: the thruster sees the command times (bus voltage / its "
            f"highest)^{theta[0]:.2f}; keep the supply up, or correct by the recorded bus voltage."
        )


FORMS = (SupplySag(),)
