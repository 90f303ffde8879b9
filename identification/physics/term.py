"""What a piece of physics is: a named change of a prediction, with bounded parameters.

A prediction passes stages in the order of the bench: `command` (V that the rotor answers to), `rotor` (V to the rate
it reaches, in volts of the steady state), `hydro` (thrust of the propeller), `stand` (force that reaches the cell),
`cell` (its reading). Terms of a model act in that order, so models are closed under `+`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

from identification.physics.traits import Traits
from identification.recording import Floats
from identification.run_history.history import History
from identification.run_history.remembered import RememberedRun

Stage = Literal["command", "rotor", "hydro", "stand", "cell"]
THERMOMETER = "motor_temperature"
"""The channel of the motor's temperature."""
KELVIN = 273.15
"""At 0 degC."""
MEASURED: tuple[Stage, ...] = ("stand", "cell")
"""Stages behind the thruster: what acts there changes what is measured, and no vehicle has it."""
WEIGHED = 4.0
"""Standard deviations by which a cell may bend otherwise than its dead weights said."""
STAGES: tuple[Stage, ...] = ("command", "rotor", "hydro", "stand", "cell")


@dataclass(frozen=True, slots=True)
class Scale:
    """Sizes that bounds and trial values are made of: nothing depends on one bench's volts and newtons."""

    driver: float
    """Largest |driver|, in `driver_unit`."""
    driver_unit: str
    thrust: float
    """N: C driver^2."""
    duration: float
    """s of the longest run."""
    interval: float
    """s, the shortest interval of the grid."""
    flow: float = 0.0
    """m/s, the largest |flow_speed|."""
    reading: float = 0.0
    """N, the largest |thrust| that was read, tare and all."""
    noise: float = 0.0
    """N, standard deviation of one thrust sample between neighbours."""
    torque: float = 0.0
    """N m: |torque| at the largest driver, by a square law through all of it; 0 where none was recorded."""
    spacing: float = 0.0
    """s between thrust samples, the shortest of all runs: what is over within one of them has no time of its own."""
    bus: float = 0.0
    """V, the highest bus_voltage of all runs: what every run's supply is referred to. 0, here and below: not known
    (none was recorded, or a twin of an earlier version), and each run is referred to its own."""
    current: float = 0.0
    """A, the largest |current| of all runs."""
    neighbour: float = 0.0
    """N, the largest |neighbour_thrust| of all runs."""
    cold: float = 0.0
    """K, the lowest motor_temperature that a run began with."""
    cold_error: float = 0.0
    """K, its standard error."""
    cell_even: float = 0.0
    """1/N, standard deviation of what bend F^2 dead weights left the load cell; 0, here and below: not known, nobody
    hung any or not so heavy ones."""
    cell_odd: float = 0.0
    """1/N, of F|F|."""
    cell_cubic: float = 0.0
    """1/N^2, of F^3."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of a term. `neutral`: where the term is absent, None for an inner parameter (a time constant)."""

    name: str
    unit: str
    low: float
    high: float
    neutral: float | None = None
    whole: bool = False
    """`high` is the textbook's own value: to lie there is no doubt."""
    jumps: bool = False
    """The prediction jumps at this value (an instant, a threshold): chi-square rises in stairs, not as a parabola."""
    blur: float = 0.0
    """Over which the term spreads a threshold, so that its prediction is continuous: none is told more closely."""
    told: str = ""
    """As a noun in a sentence; empty: its name says it."""


@dataclass(frozen=True, eq=False, slots=True)
class TermContext:
    """What a term may look at beside the value that it changes. Arrays (M,) on the intervals of the history."""

    run: RememberedRun
    scale: Scale
    C: float
    tare: float
    """N, of this run."""
    x: Floats
    """Rate of the rotor in units of the driver: thrust is C x|x| without any term. In stage command: the driver."""
    winding: float | None = None
    """Voltage that the model loses in the cold winding, by the square of the rate, 1/(unit of the driver); None where
    it says nothing of it."""

    before: Floats | None = None
    """Rate before a fast change that was made to `x`: what has a memory has not followed that; None: none was made."""

    @property
    def history(self) -> History:
        return self.run.history

    @property
    def settled(self) -> Floats:
        """Rate that what has a memory follows."""
        return self.x if self.before is None else self.before


@dataclass(frozen=True, slots=True)
class EquationContext:
    """What a term may write of the model beside its own values."""

    scale: Scale
    C: float
    driver: str = "command_voltage"
    """What drives, by its name in a recording: the variable of stage command is what the terms before made of it."""
    winding: float | None = None
    """As in TermContext."""
    rate_per_driver: float = 1.0
    """rev/s per unit of the driver: what a measured rate is referred to."""
    recorded: frozenset[str] = frozenset()
    """Quantities that are there beside command and thrust."""

    @property
    def symbol(self) -> str:
        """The variable of stage command."""
        return "n" if self.driver == "rotation_rate" else "V"


class Term(Protocol):
    """One effect in one textbook form."""

    @property
    def id(self) -> str:
        """Effect id of the catalogue."""

    @property
    def form(self) -> str:
        """Which textbook form; empty where there is one."""

    @property
    def stage(self) -> Stage: ...

    @property
    def physics(self) -> str:
        """One clause: what it says is left out."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Quantities that must be recorded."""

    @property
    def covariates(self) -> tuple[str, ...]:
        """Covariates over which its shape can be tested against a free form."""

    @property
    def traits(self) -> Traits:
        """What an engine must know of it beside its prediction."""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        """In the order of theta; the first one is the amount."""

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        """Small but finite amounts at several inner settings, to look for it with."""

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        """Trials closely round the best one, where a fit could not find its way between them; empty for most terms."""

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        """The value of its stage (M,) with this effect in it."""

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        """The same as lines to be typed in, in continuous time, with numbers of six digits in SI (equation.py).

        They change the variable of the stage: `V` (`n` where a rate drives) for command, `F` from hydro on; a term of
        stage rotor makes `x` of `V`. Behind them are `x`, the time `t`, `tare` in stage cell, and recorded quantities
        by their names. A `# comment` says what a line can't."""

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        """One sentence a person can act on."""
