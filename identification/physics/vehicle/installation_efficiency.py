"""Installation efficiency (section 4.2.1): beside a hull, or in a jet, a thruster gives less than it did alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from identification.physics.term import Parameter
from identification.physics.vehicle.term import Scale, Stage, Untouched, VehicleContext
from identification.recording import Floats

LEAST = 0.05
"""No thruster that moves a vehicle loses more."""


@dataclass(frozen=True, slots=True)
class InstallationEfficiency(Untouched):
    """Thrust times eta where the interaction `name` of the lay-out applies."""

    id: ClassVar[str] = "installation_efficiency"
    stage: ClassVar[Stage] = "thrust"
    physics: ClassVar[str] = "installed, thrusters give less than alone in the tunnel"
    covariates: ClassVar[tuple[str, ...]] = ("command_voltage",)
    form: Literal["overall", "propeller_hull", "propeller_propeller"] = "overall"
    name: str = "eta"

    def needs(self, scale: Scale) -> str:
        if self.form != "overall" or (scale.mass is not None and scale.thrust_known):
            return ""
        lacks = "the mass" if scale.thrust_known else "the thrusters' models"
        return (
            f"an efficiency common to all thrusters ({self.name}) cannot be told: without {lacks} only ratios to mass "
            "and drag are seen"
        )

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter(self.name, "1", LEAST, 1.0, 1.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.97,), (0.85,), (0.5,))

    def on_thrust(self, thrust: Floats, now: VehicleContext, theta: tuple[float, ...]) -> Floats:
        out: Floats = (
            thrust * theta[0] if self.form == "overall" else np.where(now.active[self.name], thrust * theta[0], thrust)
        )
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        percent = f"{100 * theta[0]:.3g} % of the thrust that their models promise"
        match self.form:
            case "propeller_hull":
                return (
                    f"Installation efficiency: with their jet against the hull, thrusters give {percent} ({self.name})."
                )
            case "propeller_propeller":
                return f"Installation efficiency: thrusters that run in each other's jet give {percent} ({self.name})."
            case _:
                mass = f", given a mass of {scale.mass:.4g} {scale.mass_unit}" if scale.mass is not None else ""
                return f"Installation efficiency: on the vehicle the thrusters give {percent} ({self.name}){mass}."


FORMS = (
    InstallationEfficiency("overall"),
    InstallationEfficiency("propeller_hull", "eta_hull"),
    InstallationEfficiency("propeller_propeller", "eta_pair"),
)
"""Under their usual names; a search takes those that the lay-out has."""
