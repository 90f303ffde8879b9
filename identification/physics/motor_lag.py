"""Rotor inertia: first order x' = (V - x)/tau, or the torque balance x' = a (V|V| - x|x|)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from identification.physics.filters import lag, lowpass
from identification.physics.term import Moment, Parameter, Scale, Stage
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class MotorLag:
    """Rotor inertia: first order x' = (V - x)/tau, or the torque balance x' = a (V|V| - x|x|)."""

    id: ClassVar[str] = "motor_lag"
    stage: ClassVar[Stage] = "rotor"
    physics: ClassVar[str] = "the rotor needs time to follow"
    needs: ClassVar[tuple[str, ...]] = ()
    coordinates: ClassVar[tuple[str, ...]] = ("time_since_step",)
    form: Literal["first_order", "quadratic"] = "first_order"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("time_constant", "s", 0.0, 10.0, 0.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return tuple((tau,) for tau in (0.005, 0.02, 0.06, 0.15, 0.4, 1.0) if tau >= 0.1 * scale.interval)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: Moment, theta: tuple[float, ...]) -> Floats:
        tau = theta[0]
        if tau <= 1e-6:
            return value
        start = float(value[0])
        if self.form == "quadratic":
            return lag(value, now.history.dt, 1 / (2 * tau * now.scale.driver), 0.0, start)
        return lowpass(value, now.history.dt, tau, start)[1]

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        at = f" at {scale.driver:.3g} {scale.driver_unit}, slower at less" if self.form == "quadratic" else ""
        return f"Motor lag: the rotor follows the command with a time constant of {1000 * theta[0]:.3g} ms{at}."


FORMS = (
    MotorLag("first_order"),
    MotorLag("quadratic"),
)
