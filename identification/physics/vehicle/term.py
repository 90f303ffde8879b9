"""What a piece of a vehicle's physics is: a named change of its thrusters' volts, of their thrust, or of the body.

The uncoupled vehicle of one axis is m v' = -drag(v - c) + sum of arm x thrust, v over ground, c the water's own speed.
A prediction passes stages: `command` (V that each rotor answers to), `thrust` (N of each thruster as mounted), `body`
(mass, drags, steady forces and the water). Terms of a model act in that order, so models are closed under `+`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from identification.physics.term import Parameter
from identification.recording import Floats

Stage = Literal["command", "thrust", "body"]
STAGES: tuple[Stage, ...] = ("command", "thrust", "body")


@dataclass(frozen=True, slots=True)
class Scale:
    """Sizes that bounds and trial values are made of; of yaw in rad and N.m."""

    axis: str
    volts: float
    """V, the largest |command|."""
    force: float
    """N, the largest force that the thrusters' models promise on the axis."""
    speed: float
    """m/s, the largest speed that was measured."""
    length: float
    """m, the longest way from the start of a run."""
    duration: float
    """s of the longest run."""
    interval: float
    """s of the grid."""
    mass: float | None
    """kg as stated; None: not stated, the mass is then a parameter or everything is per kg."""
    thrust_known: bool
    """Whether the thrusters' models are measured ones, in newtons."""
    heading_spread: float = 0.0
    """Of the mean heading's direction, 0 (one heading) to 1 (all round); NaN: no heading."""
    ballasts: tuple[str, ...] = ()
    """Names of the buoyancies; one where all recordings have the same ballast."""
    per_kg: bool = False
    """Neither mass nor thrust is known: forces are per kg of inertia."""

    @property
    def force_unit(self) -> str:
        return ("N.m" if self.axis == "yaw" else "N") + (" per kg" if self.per_kg else "")

    @property
    def speed_unit(self) -> str:
        return "rad/s" if self.axis == "yaw" else "m/s"

    @property
    def length_unit(self) -> str:
        return "rad" if self.axis == "yaw" else "m"

    @property
    def mass_unit(self) -> str:
        return "kg.m^2" if self.axis == "yaw" else "kg"

    def over(self, *units: str) -> str:
        """Unit of a force divided by others.

        >>> Scale("heave", 1.0, 1.0, 1.0, 1.0, 1.0, 0.1, None, True).over("(m/s)^2", "m")
        'N/(m/s)^2/m'
        """
        kind, _, rest = self.force_unit.partition(" ")
        return "/".join([kind, *units]) + (f" {rest}" if rest else "")


@dataclass(frozen=True, eq=False, slots=True)
class VehicleContext:
    """What a term may look at in one run, on its grid of g steps with S looks at the command in each."""

    scale: Scale
    step: float
    """s of the grid."""
    volts: Floats
    """(T, g, S) V of each thruster as commanded."""
    active: Mapping[str, NDArray[np.bool_]]
    """interaction -> (T, g, S) whether it applies."""
    heading: Floats
    """(g,) rad; NaN where it was not recorded."""
    ballast: str = ""
    run: str = ""
    """Recording id."""


@dataclass(frozen=True, eq=False, slots=True)
class Body:
    """One run's vehicle: m v' = push + steady - drag."""

    mass: float
    linear: float = 0.0
    quadratic: float = 0.0
    astern: float = 1.0
    """Factor of the quadratic drag when it moves backwards through the water."""
    line_drag: float = 0.0
    """N/(m/s)^2 for each m of line paid out."""
    line_pull: float = 0.0
    """N/m towards where the line comes from."""
    steady: Floats | float = 0.0
    """N; (g,) where it is not the same throughout."""
    water: Floats = field(default_factory=lambda: np.zeros(1))
    """(g,) or (1,) m/s of the water along the axis."""


class VehicleTerm(Protocol):
    """One effect in one textbook form. `on_volts`, `on_thrust` or `on_body` acts, whichever its stage names."""

    @property
    def id(self) -> str: ...

    @property
    def form(self) -> str: ...

    @property
    def stage(self) -> Stage: ...

    @property
    def physics(self) -> str:
        """One clause: what it says is left out."""

    @property
    def covariates(self) -> tuple[str, ...]:
        """Covariates over which its shape shows."""

    def needs(self, scale: Scale) -> str:
        """Why it cannot be told from these recordings, as a sentence; empty: it can."""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        """In the order of theta; the first one is the amount."""

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        """Amounts to start a fit from."""

    def on_volts(self, volts: Floats, now: VehicleContext, theta: tuple[float, ...]) -> Floats:
        """(T, g, S)"""

    def on_thrust(self, thrust: Floats, now: VehicleContext, theta: tuple[float, ...]) -> Floats:
        """(T, g, S) N"""

    def on_body(self, body: Body, now: VehicleContext, theta: tuple[float, ...]) -> Body: ...

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        """One sentence a person can act on."""


class Untouched:
    """Stages that a term leaves as they are."""

    __slots__ = ()

    def needs(self, scale: Scale) -> str:
        return ""

    def on_volts(self, volts: Floats, now: VehicleContext, theta: tuple[float, ...]) -> Floats:
        return volts

    def on_thrust(self, thrust: Floats, now: VehicleContext, theta: tuple[float, ...]) -> Floats:
        return thrust

    def on_body(self, body: Body, now: VehicleContext, theta: tuple[float, ...]) -> Body:
        return body
