"""Viscoelastic cell: F + c lowpass(F) over tens of seconds, with one or two time constants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from identification.physics.equation import follows, signed
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats
from identification.run_history.filters import lowpass

MOST = 0.1
"""Share of the load. A good cell creeps by 0.00025 of it in half an hour (class C3 of OIML R 60: 0.7 of the largest
permissible error), a cheap or printed one by some hundredths: what is larger is something else that comes late."""


@dataclass(frozen=True, slots=True)
class LoadCellCreep:
    """Viscoelastic cell: F + c lowpass(F) over tens of seconds, with one or two time constants."""

    id: ClassVar[str] = "load_cell_creep"
    stage: ClassVar[Stage] = "cell"
    physics: ClassVar[str] = "the load cell creeps under load"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("time_since_step", "time")
    traits: ClassVar[Traits] = Traits(
        moving=True,
        shown_over="time_since_step",
        shown_as="step",
        revealed_by="a rest after a long load: creep goes on there",
    )
    form: Literal["one_constant", "two_constants"] = "one_constant"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        known = (Parameter("share", "1", -MOST, MOST, 0.0), Parameter("time_constant", "s", 1.0, 600.0))
        if self.form == "one_constant":
            return known
        return (
            *known,
            Parameter("share_2", "1", -MOST, MOST, told="second share"),
            Parameter("time_constant_2", "s", 1.0, 2000.0, told="second time constant"),
        )

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        if self.form == "one_constant":
            return tuple((0.02, tau) for tau in (3.0, 10.0, 30.0, 100.0))
        return ((0.02, 8.0, 0.02, 60.0), (0.02, 20.0, 0.02, 200.0))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        out: Floats = value + theta[0] * lowpass(value, now.history.dt, theta[1])[1]
        if self.form == "two_constants":
            out += theta[2] * lowpass(value, now.history.dt, theta[3])[1]
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        share, tau, *second = theta
        if not second:
            return follows("creep", "F", tau), f"F = F {signed(share)} * creep"
        return (
            follows("creep", "F", tau),
            follows("creep_2", "F", second[1]),
            f"F = F {signed(share)} * creep {signed(second[0])} * creep_2",
        )

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Load-cell creep: {100 * theta[0]:.2g} % of the load comes late, "
            f"with a time constant of {theta[1]:.3g} s, and leaves late."
        )


FORMS = (LoadCellCreep("one_constant"), LoadCellCreep("two_constants"))
