"""Rotor inertia: first order x' = (V - x)/tau, the torque balance x' = a (V|V| - x|x|), or both at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from identification.physics.equation import follows
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Dynamics, Traits
from identification.recording import Floats

AT_ONCE = 1e-6
"""s: a rotor that is quicker follows at once."""
SLOWEST = 1e-3
"""Of the time constant's inverse: the least rate of following, of a rotor that hardly turns."""
NEARLY_LINEAR = 0.9
"""Linear share from which a lag is told as one that is the same at all levels."""


def torques(form: str, theta: tuple[float, ...], largest: float) -> tuple[float, float]:
    """Coefficients of n' = quadratic (w|w| - n|n|) + linear (w - n), the time constant being that at the largest w."""
    linear = {"first_order": 1.0, "quadratic": 0.0}.get(form, theta[-1])
    return (1 - linear) / (2 * theta[0] * largest), linear / theta[0]


def _dynamics(term: MotorLag, theta: tuple[float, ...], largest: float) -> Dynamics:
    if theta[0] <= AT_ONCE:
        return Dynamics()
    return Dynamics(rotor=torques(term.form, theta, largest), slowest=SLOWEST / theta[0])


@dataclass(frozen=True, slots=True)
class MotorLag:
    """Rotor inertia: x' = a (V|V| - x|x|) + b (V - x); first order without a, the torque balance without b.

    The water's torque grows with the square of the rate, back-EMF and the controller's hold with the rate itself.
    """

    id: ClassVar[str] = "motor_lag"
    stage: ClassVar[Stage] = "rotor"
    physics: ClassVar[str] = "the rotor needs time to follow"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("time_since_step",)
    traits: ClassVar[Traits] = Traits(
        moving=True,
        delays=True,
        dynamics=_dynamics,
        quick="time_constant",
        shown_over="time_since_step",
        shown_as="step",
        told_by=(("rotation_rate", "the measured rotation rate"),),
        revealed_by="small and large steps, sampled fast; the measured rotation rate",
    )
    form: Literal["first_order", "quadratic", "mixed"] = "first_order"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        tau = Parameter("time_constant", "s", 0.0, 10.0, 0.0)
        return (tau, Parameter("linear_share", "1", 0.0, 1.0)) if self.form == "mixed" else (tau,)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        rest = (0.5,) if self.form == "mixed" else ()
        return tuple((tau, *rest) for tau in (0.005, 0.02, 0.06, 0.15, 0.4, 1.0) if tau >= 0.1 * scale.interval)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        if theta[0] <= AT_ONCE:
            return value
        return now.run.followed(value, torques(self.form, theta, now.scale.driver))

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        V = model.symbol
        if theta[0] <= AT_ONCE:
            return (f"x = {V}",)
        if self.form == "first_order":
            return (follows("x", V, theta[0], f"{V}(0)"),)
        quadratic, linear = torques(self.form, theta, model.scale.driver)
        rate = f"{quadratic:.6g} * ({V} * abs({V}) - x * abs(x))"
        rate += f" + {linear:.6g} * ({V} - x)" if self.form == "mixed" else ""
        return (f"d(x)/dt = {rate}, x(0) = {V}(0)",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        alike = self.form == "first_order" or (self.form == "mixed" and theta[1] > NEARLY_LINEAR)
        slower = "" if alike else f" at {scale.driver:.3g} {scale.driver_unit}, slower at less"
        return f"Motor lag: the rotor follows the command with a time constant of {1000 * theta[0]:.3g} ms{slower}."


FORMS = (
    MotorLag("first_order"),
    MotorLag("quadratic"),
    MotorLag("mixed"),
)
