"""Winding and magnets warm up and thrust falls in proportion: by the thermometer, or by the power drawn before."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from identification.physics.term import Parameter, Scale, Stage, TermContext
from identification.physics.traits import Proxy, Traits
from identification.recording import Floats
from identification.run_history.filters import lowpass
from identification.run_history.history import History

THERMOMETER = "motor_temperature"
MOST_PER_KELVIN = 1.0
"""1/K. Copper has 0.004, neodymium magnets 0.001; a thermometer outside sees only a part of their rise."""


def _slowest(scale: Scale) -> float:
    """s; what is slower is a trend that any cause may have."""
    return max(60.0, 0.7 * scale.duration)


POWER = Proxy(
    THERMOMETER,
    "no motor temperature was recorded",
    "the power drawn before, the fourth power of the rotor's rate as the model has it, low-passed",
    better=("current", "the power drawn before, the recorded current squared, low-passed"),
)


@dataclass(frozen=True, slots=True)
class Heating:
    """No thermometer: T (1 - h Theta), Theta' = (power - Theta)/tau, power as V^4 or I^2; magnets follow later."""

    id: ClassVar[str] = "heating"
    stage: ClassVar[Stage] = "hydro"
    physics: ClassVar[str] = "winding and magnets warm up under load"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("time",)
    traits: ClassVar[Traits] = Traits(
        moving=True,
        seen_by=THERMOMETER,
        proxy=POWER,
        shown_over="time",
        shown_as="gain",
        told_by=((THERMOMETER, "the motor temperature"),),
        revealed_by="a long load, a rest of minutes, the same load again; the motor's temperature",
    )
    form: Literal["winding", "magnet"] = "winding"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        known = (Parameter("loss", "1", 0.0, 0.95, 0.0), Parameter("time_constant", "s", 5.0, _slowest(scale)))
        if self.form == "winding":
            return known
        return (*known, Parameter("magnet_time_constant", "s", 5.0, _slowest(scale)))

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        if self.form == "winding":
            return tuple((0.05, tau) for tau in (15.0, 40.0, 100.0, 300.0) if tau < 0.7 * scale.duration)
        return tuple((0.05, tau, later) for tau, later in ((30.0, 30.0), (120.0, 60.0)) if tau < 0.7 * scale.duration)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        history = now.history
        current = history.others.get("current")
        load = (now.x / now.scale.driver) ** 4 if current is None else (current / np.nanmax(np.abs(current))) ** 2
        warm = lowpass(load, history.dt, theta[1])[1]
        if self.form == "magnet":
            warm = lowpass(warm, history.dt, theta[2])[1]
        out: Floats = value * np.maximum(1 - theta[0] * warm, 0.0)
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Heating: at full load for long thrust falls by {100 * theta[0]:.2g} %, with a time "
            f"constant of {theta[1]:.3g} s; rest between loads, or record the motor temperature."
        )


@dataclass(frozen=True, slots=True)
class MeasuredHeating:
    """T (1 - b (T_m - T_0)): the recorded temperature, from where it began; magnets follow it later."""

    id: ClassVar[str] = "heating"
    stage: ClassVar[Stage] = "hydro"
    physics: ClassVar[str] = "winding and magnets warm up under load"
    needs: ClassVar[tuple[str, ...]] = (THERMOMETER,)
    covariates: ClassVar[tuple[str, ...]] = (THERMOMETER, "time")
    traits: ClassVar[Traits] = Traits(
        moving=True,
        seen_by=THERMOMETER,
        shown_over="time",
        shown_as="gain",
        told_by=((THERMOMETER, "the motor temperature"),),
        revealed_by="a long load, a rest of minutes, the same load again; the motor's temperature",
    )
    form: Literal["measured_winding", "measured_magnet"] = "measured_winding"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        known = (Parameter("loss_per_kelvin", "1/K", 0.0, MOST_PER_KELVIN, 0.0),)
        if self.form == "measured_winding":
            return known
        return (*known, Parameter("magnet_time_constant", "s", 5.0, _slowest(scale)))

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        if self.form == "measured_winding":
            return ((0.001,),)
        return tuple((0.001, tau) for tau in (15.0, 60.0, 200.0) if tau < 0.7 * scale.duration)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        warm = _rise(now.history)
        if self.form == "measured_magnet":
            warm = lowpass(warm, now.history.dt, theta[1])[1]
        out: Floats = value * np.maximum(1 - theta[0] * warm, 0.0)
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        later = "" if self.form == "measured_winding" else f", {theta[1]:.3g} s late"
        return f"Heating: thrust falls by {100 * theta[0]:.2g} % per kelvin of the motor temperature{later}."


def _rise(history: History) -> Floats:
    """(M,) K beyond where the run began."""
    measured = history.others[THERMOMETER]
    out: Floats = measured - measured[0]
    return out


FORMS = (Heating("winding"), Heating("magnet"), MeasuredHeating("measured_winding"), MeasuredHeating("measured_magnet"))
