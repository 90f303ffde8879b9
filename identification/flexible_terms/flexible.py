"""A shape that no physics is claimed for: a spline over one covariate, times what it multiplies.

It is a term like any other, so that a model with it is fitted, judged, saved and simulated as models are; but it is in
no catalogue, and no search ever proposes it. Beyond the knots it is constant: nothing is known there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats
from identification.run_history.filters import lowpass, since_opposite
from identification.run_history.history import TURNING, History
from identification.run_history.remembered import RememberedRun
from identification.run_history.slip import slip
from identification.run_history.splines import spline

Multiplier = Literal["force", "gain", "even", "step", "reversed", "rate", "drive", "late"]
"""What the spline multiplies: 1, the thrust T, |T|, the change of T since the level before, T once it has turned the
other way, |x|, what T was lately less what it is; or it adds to x."""
MULTIPLIERS: tuple[Multiplier, ...] = ("force", "gain", "even", "step", "reversed", "rate", "drive", "late")
WORDS: dict[Multiplier, str] = {
    "force": "adds a force",
    "gain": "multiplies the thrust",
    "even": "adds a force in proportion to the size of the thrust",
    "step": "acts on the change of thrust since the level before",
    "reversed": "multiplies the thrust, by the time since it turned the other way",
    "rate": "adds a force in proportion to the size of the drive",
    "drive": "adds to the drive",
    "late": "lets a share of the thrust come late",
}
ALONE: tuple[Multiplier, ...] = ("force", "gain", "even", "drive")
"""Where a constant would be the tare, another C, an asymmetry or another rate: the spline is zero at `zero`."""
COMPUTED = ("time", "time_since_step", "previous_voltage", "direction", "direction_of_change", "load_history")
"""Coordinates that every run has."""
TABLE = "curve: the table of what is not explained"
MOST = 5.0
"""Bound of a coefficient, in full thrusts or full drives."""


@dataclass(frozen=True, slots=True)
class Flexible:
    """A cubic or broken line through values at knots over a covariate."""

    physics: ClassVar[str] = "a free shape; no physics is claimed for it"
    quantity: str
    unit: str
    knots: tuple[float, ...]
    """Ascending, in `unit`, within what was recorded."""
    zero: tuple[int, ...]
    """Knots at which it is zero by definition."""
    times: tuple[Multiplier, ...]
    degree: Literal[1, 3] = 3
    memory: float = 0.0
    """s, of load_history."""
    period: float = 0.0
    """s after which a spline over time begins anew; 0: never."""

    @property
    def traits(self) -> Traits:
        return Traits(own_clock=self.quantity == "time")

    @property
    def id(self) -> str:
        return f"flexible:{self.quantity}"

    @property
    def form(self) -> str:
        return "+".join(self.times)

    @property
    def stage(self) -> Stage:
        return "rotor" if "drive" in self.times else "hydro"

    @property
    def needs(self) -> tuple[str, ...]:
        own = (*COMPUTED, "command_voltage", "motor_voltage")
        return () if self.quantity in own or self.by_driver else (self.quantity,)

    @property
    def by_driver(self) -> bool:
        """Over a measured rate that drives the model: that is the driver, no channel beside it."""
        return self.quantity == "rotation_rate" and "drive" not in self.times

    @property
    def covariates(self) -> tuple[str, ...]:
        return (self.quantity,)

    def zeros(self, multiplier: Multiplier) -> tuple[int, ...]:
        """Knots at which the spline of this multiplier is zero."""
        return self.zero if multiplier in ALONE or self.quantity == "time_since_step" else ()

    def free(self, multiplier: Multiplier) -> tuple[int, ...]:
        return tuple(i for i in range(len(self.knots)) if i not in self.zeros(multiplier))

    def unit_of(self, multiplier: Multiplier, scale: Scale) -> str:
        """Of the spline's values."""
        return {"force": "N", "rate": "N", "drive": scale.driver_unit}.get(multiplier, "1")

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        size = max(scale.thrust, scale.reading)
        most = {"force": MOST * size, "rate": MOST * size, "drive": MOST * scale.driver}
        return tuple(
            Parameter(f"{m}_at_{self.knots[i]:g}", self.unit_of(m, scale), -most.get(m, MOST), most.get(m, MOST), 0.0)
            for m in self.times
            for i in self.free(m)
        )

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        over = self.axis(self.over(now.run, now.x, now.scale))
        out, at = value, 0
        for m in self.times:
            free = self.free(m)
            heights = np.zeros(len(self.knots))
            heights[list(free)] = theta[at : at + len(free)]
            at += len(free)
            out = out + spline(over, self.axis(np.array(self.knots)), heights, self.degree) * multiplied(
                m, value, now, self.memory
            )
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        over = self._told_over(model)
        curves = [f"curve{'_' * (len(self.times) > 1)}{m if len(self.times) > 1 else ''}({over})" for m in self.times]
        parts = " + ".join(c + self._told_times(m, model) for c, m in zip(curves, self.times, strict=True))
        made, of = ("x", model.symbol) if self.stage == "rotor" else ("F", "F")
        return (f"{made} = {of} + {parts}  # {TABLE}",)

    def _told_over(self, model: EquationContext) -> str:
        if self.quantity == "time":
            return f"t % {self.period:.6g}" if self.period else "t"
        if self.quantity == "rotation_rate" and "drive" in self.times:
            return f"rotation_rate / {model.rate_per_driver:.6g} - {model.symbol}"
        return self.quantity

    def _told_times(self, multiplier: Multiplier, model: EquationContext) -> str:
        match multiplier:
            case "force" | "drive":
                return ""
            case "gain" | "reversed":
                return " * F"
            case "even":
                return " * abs(F)"
            case "step":
                return f" * (F - {model.C:.6g} * previous_voltage * abs(previous_voltage))"
            case "rate":
                return f" * abs(x) / {model.scale.driver:.6g}"
            case "late":
                return f" * (lowpass(F, {self.memory:.6g}) - F)"

    def over(self, run: RememberedRun, x: Floats, scale: Scale) -> Floats:
        """(M,) of the covariate, in `unit`."""
        history = run.history
        match self.quantity:
            case "time":
                return history.middle % self.period if self.period else history.middle
            case "time_since_step" if "reversed" in self.times:
                return turned(history, x, scale)[0]
            case "time_since_step":
                return history.since_step
            case "previous_voltage":
                return history.previous
            case "direction":
                return np.where(np.abs(history.driver) > TURNING * scale.driver, np.sign(history.driver), 0.0)
            case "direction_of_change":
                return history.direction_of_change
            case "load_history":
                return lowpass((x / scale.driver) ** 2, history.dt, self.memory)[1]
            case "rotation_rate" if "drive" in self.times:
                return slip(run, x, history.rate_per_driver)
            case quantity if quantity == history.driver_quantity:
                return history.driver
            case quantity:
                return history.others[quantity]

    def axis(self, over: Floats) -> Floats:
        """The scale on which it is smooth: the logarithm of a time since something."""
        if self.quantity != "time_since_step":
            return over
        out: Floats = np.log(np.maximum(over, self.knots[0]))
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        what = " and ".join(WORDS[m] for m in self.times)
        of_run = " It is of this run's own clock: another run need not repeat it." if self.quantity == "time" else ""
        anew = f" and begins anew every {self.period:.4g} s" if self.period else ""
        over = f"A free curve over {self.quantity} ({len(self.knots)} knots)"
        return f"{over} {what}{anew}; no physics is claimed for it.{of_run}"


def multiplied(multiplier: Multiplier, value: Floats, now: TermContext, memory: float) -> Floats:
    """(M,) what the spline is multiplied by."""
    match multiplier:
        case "force" | "drive":
            return np.ones_like(value)
        case "gain":
            return value
        case "even":
            return np.abs(value)
        case "step":
            before = now.history.previous
            out: Floats = value - now.C * before * np.abs(before)
            return out
        case "reversed":
            return np.where(turned(now.history, now.x, now.scale)[1], value, 0.0)
        case "rate":
            return np.abs(now.x) / now.scale.driver
        case "late":
            return lately(value, now.history.dt, memory)


def turned(history: History, x: Floats, scale: Scale) -> tuple[Floats, NDArray[np.bool_]]:
    """S since it last turned the other way, and whether it ever did; (M,). A sine turns without a step."""
    age, _, known = since_opposite(x, history.dt, TURNING * scale.driver)
    return np.where(known, age, 0.0), known


def lately(force: Floats, dt: Floats, memory: float) -> Floats:
    """(M,) low-pass of the force over `memory` s, less the force."""
    return lowpass(force, dt, memory)[1] - force
