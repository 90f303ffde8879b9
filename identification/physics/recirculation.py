"""The jet comes round the tunnel: T - k |x| u, u' = (j - u)/tau, j = x or as momentum theory has it sqrt(T/C).

Or late, on a circuit through two volumes of water: u' = (w - u)/tau, w' = (x - w)/tau.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from identification.physics.digits import percent
from identification.physics.equation import follows
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Proxy, Traits
from identification.recording import Floats
from identification.run_history.rotor_lag import Rotor

JET = "the rotor's rate as the model has it, low-passed"
INSTEAD = {"rate": JET, "thrust": "the root of the thrust, low-passed", "circuit": f"{JET} twice"}
"""Of the flow, where none was recorded."""


@dataclass(frozen=True, slots=True)
class Recirculation:
    """The jet comes round the tunnel: T - k |x| u, u' = (j - u)/tau, j = x or as momentum theory has it sqrt(T/C)."""

    id: ClassVar[str] = "recirculation"
    stage: ClassVar[Stage] = "hydro"
    physics: ClassVar[str] = "the jet of the thruster comes round the tunnel"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("time_since_step", "time")
    form: Literal["rate", "thrust", "circuit"] = "rate"

    @property
    def traits(self) -> Traits:
        proxy = Proxy("flow_speed", "no flow was recorded", INSTEAD[self.form])
        return Traits(
            moving=True,
            proxy=proxy,
            shown_over="time_since_step",
            shown_as="gain",
            revealed_by="long levels in alternating directions, with rests for the water to calm",
        )

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (
            Parameter(
                "coefficient",
                f"N/{scale.driver_unit}^2",
                0.0,
                0.9 * scale.thrust / scale.driver**2,
                0.0,
                told="strength",
            ),
            Parameter("time_constant", "s", 3.0, max(30.0, min(300.0, 0.5 * scale.duration))),
        )

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        slowest = self.parameters(scale)[1].high
        taus = [tau for tau in (5.0, 12.0, 30.0, 80.0) if tau <= slowest]
        return tuple((0.05 * scale.thrust / scale.driver**2, tau) for tau in taus)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        jet = np.sign(value) * np.sqrt(np.abs(value / now.C)) if self.form == "thrust" else now.settled
        follows = Rotor(0.0, 1 / theta[1])
        u = now.run.follower(jet, follows)
        if self.form == "circuit":
            u = now.run.follower(u, follows)
        out: Floats = value - theta[0] * np.abs(now.x) * u
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        coefficient, tau = theta
        made = follows(
            "jet", {"rate": "x", "thrust": f"sign(F) * sqrt(abs(F / {model.C:.6g}))", "circuit": "far"}[self.form], tau
        )
        water = (follows("far", "x", tau), made) if self.form == "circuit" else (made,)
        return *water, f"F = F - {coefficient:.6g} * abs(x) * jet"

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        most = percent(theta[0] * scale.driver**2 / scale.thrust)
        return (
            f"Recirculation: the jet comes round and takes up to {most} "
            f"% of the thrust within {theta[1] * (2 if self.form == 'circuit' else 1):.3g} s of one direction."
        )


FORMS = (Recirculation("rate"), Recirculation("thrust"), Recirculation("circuit"))
