"""What else is to be known of a term beside its prediction: an engine that reads it spells out no effect."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from identification.recording import Floats
from identification.run_history.history import History
from identification.run_history.rotor_lag import Rotor

SignatureKind = Literal["force", "gain", "step", "turn"]
"""What is averaged where an effect is shown: the residual itself / N; its share of the thrust; its share of the last
change of thrust; the residual towards the last change of the driver / N (half the width of a loop)."""


@dataclass(frozen=True, slots=True)
class Dynamics:
    """What a term does between the ticks of a command, which intervals are too long to show."""

    rotor: Rotor | None = None
    slowest: float = 0.0
    """1/s, the least rate at which such a rotor follows a small change."""
    ring: tuple[float, float, float] | None = None
    """Compliance, frequency in Hz and damping of a stand that rings."""
    delay: float = 0.0
    """s by which the reading comes late."""


@dataclass(frozen=True, slots=True)
class Proxy:
    """What a form takes in the place of a quantity that nobody recorded."""

    quantity: str
    """Of recording-format.md; where it is recorded the form looks at it, or stands beside one that does."""
    lacks: str
    instead: str
    better: tuple[str, str] | None = None
    """Another quantity, and what of it is taken where that one was recorded."""


class LimitsCommand(Protocol):
    """A term whose drive clips the command."""

    def passed(self, history: History, theta: tuple[float, ...]) -> Floats:
        """(M,) share of what the command does within each interval that the drive gives the rotor."""


class LimitsReading(Protocol):
    """A term whose cell or amplifier clips the reading."""

    @property
    def sharp(self) -> bool:
        """Whether readings end at one value, and not over a knee."""

    @property
    def silent(self) -> bool:
        """Whether the amplifier's own noise is clipped too."""

    def shown(self, history: History, C: float, x: Floats, reading: Floats, theta: tuple[float, ...]) -> Floats:
        """(M,) share of what the force does within each interval that the cell shows."""

    def slope(self, reading: Floats, theta: tuple[float, ...]) -> Floats:
        """What the cell would show of a small change where it reads `reading` N."""

    def start(self, theta: tuple[float, ...], side: Floats | float) -> Floats | float:
        """N, by size: where the cell begins to show less, on a side, 1 or -1."""


class SpreadJump(Protocol):
    """A term that jumps at a threshold, spread so that a fit can follow where it lies."""

    def sharp(self) -> Any:
        """The term as physics has it, for a threshold that is not sought but known."""


@dataclass(frozen=True, slots=True)
class Traits:
    """Of one effect in one form. Most have none."""

    moving: bool = False
    """It needs a course of time: it is not to be seen in a table of levels."""
    delays: bool = False
    """It comes late after a step: clocks that differ look alike."""
    own_clock: bool = False
    """It is of one run's own time: another run need not repeat it."""
    one_shape: bool = False
    """No instant, place or scale is looked for: it pays for itself alone."""
    from_data: bool = False
    """Some of its trials are where the data point to: it pays for all its parameters in full."""
    spread: bool = False
    """SpreadJump: a level within the blur of its threshold is taken half for one beyond it."""
    tick_by_tick: bool = False
    """It lets the ticks of a command pass one by one: no slope says what becomes of those that cross its threshold."""
    delay: str = ""
    """The parameter that is a delay of the reading: such a term takes the place of the nuisance shift of clocks."""
    instant: str = ""
    """The parameter that is an instant, anywhere in the run."""
    frequency: str = ""
    """The parameter that is a frequency in Hz: beyond half the sampling rate it has an alias below."""
    quick: str = ""
    """The parameter that is a time which the thrust samples must show: at its least it is a size without a time, and
    within what their own times are known to it is a part of how they were made."""
    even: bool = False
    """Goes as x^2 whatever the sign: one curve with every other such term, unless a torque was recorded."""
    rare: bool = False
    """Where an ordinary effect does as well, that is named, and this one stated as its rival."""
    flow: bool = False
    """Water that never moves shows nothing of it."""
    follows_rate: str = ""
    """The parameter that is the share in which thrust follows the measured rate instead of the driver."""
    refers: bool = False
    """It refers C to a voltage, a supply or a temperature: C moves with that, and nothing has changed."""
    neighbour: bool = False
    """It looks at a neighbour, of which the command stands in where its thrust was not recorded."""
    seen_by: str = ""
    """The quantity that shows the effect: forms that do without it are none where it was recorded."""
    proxy: Proxy | None = None
    winding: str = ""
    """The parameter by which voltage is lost in the winding, in proportion to the square of the rate."""
    closer: bool = False
    """With one parameter more than another form of the effect: it is asked only in the place of that."""
    own_winding: bool = False
    """It is so where no other term of the model says what the winding takes."""
    limits: Literal["", "command", "reading"] = ""
    """It clips: LimitsCommand or LimitsReading."""
    dynamics: Callable[[Any, tuple[float, ...], float], Dynamics] | None = None
    """Of the term, its values and the largest driver: what it does between ticks."""
    too_much: Callable[[Any, tuple[float, ...], float], bool] | None = None
    """Of the term, its values and the largest driver: whether they are not possible together, each within bounds."""
    shown_over: str = "driver"
    """The covariate that shows it best in a picture."""
    shown_as: SignatureKind = "force"
    revealed_by: str = ""
    """What would decide between it and another effect that explains a recording as well, as a clause."""
    told_by: tuple[tuple[str, str], ...] = ()
    """What else would tell it from others where no sweep does: (its quantity, if it is a channel; its name)."""
