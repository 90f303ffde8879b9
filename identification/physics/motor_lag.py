"""Rotor inertia: first order x' = (V - x)/tau, the torque balance x' = a (V|V| - x|x|), or both at once; and with a
drive that opens its windings at 0, where the water alone brakes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Final, Literal

from identification.physics.digits import percent
from identification.physics.equation import follows
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Dynamics, Traits
from identification.recording import Floats
from identification.run_history.rotor_lag import Rotor

AT_ONCE = 1e-6
"""s: a rotor that is quicker follows at once."""
SLOWEST = 1e-3
"""Of the time constant's inverse: the least rate of following, of a rotor that hardly turns."""
PARAMETERS: Final = {"first_order": 1, "quadratic": 1, "mixed": 2, "coasting": 3}
"""How many each form has."""
NEARLY_LINEAR = 0.9
"""Linear share from which a lag is told as one that is the same at all levels."""


MIXED: Final = ("mixed", "coasting")
"""Forms with a linear part beside the quadratic one."""


def torques(form: str, theta: tuple[float, ...], largest: float) -> Rotor:
    """The time constant is that at the largest w."""
    linear = theta[1] if form in MIXED else {"first_order": 1.0, "quadratic": 0.0}[form]
    released = theta[2] if form == "coasting" else 0.0
    return Rotor((1 - linear) / (2 * theta[0] * largest), linear / theta[0], released)


def _dynamics(term: MotorLag, theta: tuple[float, ...], largest: float) -> Dynamics:
    if theta[0] <= AT_ONCE:
        return Dynamics()
    return Dynamics(rotor=torques(term.form, theta, largest), slowest=SLOWEST / theta[0])


TRAITS: Final = Traits(
    moving=True,
    delays=True,
    dynamics=_dynamics,
    quick="time_constant",
    shown_over="time_since_step",
    shown_as="step",
    told_by=(("rotation_rate", "the measured rotation rate"),),
    revealed_by="small and large steps, sampled fast; the measured rotation rate",
)
COASTING: Final = replace(TRAITS, closer=True, rare=True)
"""Where a drive coasts its tail is plain: a little that the form repairs of something else is no sign of it."""


@dataclass(frozen=True, slots=True)
class MotorLag:
    """Rotor inertia: x' = a (V|V| - x|x|) + b (V - x); first order without a, the torque balance without b.

    The water's torque grows with the square of the rate, back-EMF and the controller's hold with the rate itself. That
    hold is missing in the share `released` where a drive opens its windings at command 0 (form `coasting`).
    """

    id: ClassVar[str] = "motor_lag"
    stage: ClassVar[Stage] = "rotor"
    physics: ClassVar[str] = "the rotor needs time to follow"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("time_since_step",)
    form: Literal["first_order", "quadratic", "mixed", "coasting"] = "first_order"

    @property
    def traits(self) -> Traits:
        return COASTING if self.form == "coasting" else TRAITS

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        tau = Parameter("time_constant", "s", 0.0, 10.0, 0.0)
        linear, released = Parameter("linear_share", "1", 0.0, 1.0), Parameter("released", "1", 0.0, 1.0)
        return (tau, linear, released)[: PARAMETERS[self.form]]

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        rest = (0.5, 1.0)[: PARAMETERS[self.form] - 1]
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
        quadratic, linear, released = torques(self.form, theta, model.scale.driver)
        coasts = self.form == "coasting"
        rate = f"{quadratic:.6g} * ({V} * abs({V}) - x * abs(x))"
        rate += f" + {'hold' if coasts else f'{linear:.6g}'} * ({V} - x)" if self.form in MIXED else ""
        hold = f"hold = where({V} == 0, {linear * (1 - released):.6g}, {linear:.6g})"
        return (*((hold,) if coasts else ()), f"d(x)/dt = {rate}, x(0) = {V}(0)")

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        alike = self.form == "first_order" or (self.form in MIXED and theta[1] > NEARLY_LINEAR)
        slower = "" if alike else f" at {scale.driver:.3g} {scale.driver_unit}, slower at less"
        coasts = ""
        if self.form == "coasting":
            coasts = f"; at command 0 the drive lets it coast, without {percent(theta[2])} % of its hold"
        ms = f"{1000 * theta[0]:.3g} ms"
        return f"Motor lag: the rotor follows the command with a time constant of {ms}{slower}{coasts}."


FORMS = (
    MotorLag("first_order"),
    MotorLag("quadratic"),
    MotorLag("mixed"),
    MotorLag("coasting"),
)
