"""Plans: frozen data whose iteration yields the steps of a run. Refused or timed before a motor turns."""

from __future__ import annotations

from collections.abc import Iterator, Set
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

from rig.campaign.dwell import Dwell
from rig.campaign.shapes import (
    MOST_MOVES,
    Hold,
    Move,
    Shape,
    Sweep,
    Wave,
    ends,
    require,
    require_above_zero,
    require_not_negative,
    steepest,
)
from rig.campaign.waits import CoolDown, Wait, wanted

Phase = Literal["tare", "ramp", "hold", "rest", "sine", "free"]
TARE_AGAIN = -2
"""Index of the tare that a run which goes on begins with: it is no step of the plan."""


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a plan.

    The command goes from the previous step's end value to `voltage` with the slew limit inside a `ramp` step of its
    own; `hold`, `rest` and `tare` keep it. A `sine` step commands `voltage + amplitude * sin(2 pi frequency t)`, t from
    its start.
    """

    index: int
    phase: Phase
    voltage: float
    """V, constant part of the command at the end of the step."""
    min_duration: float
    """s. For a fixed dwell min_duration == max_duration."""
    max_duration: float
    """s. A hold until steady ends at the latest here, with verdict `not steady`."""
    from_voltage: float = 0.0
    """V at the start; differs from `voltage` in a ramp only."""
    amplitude: float = 0.0
    frequency: float = 0.0
    settle: float = 0.0
    """s after the start of a hold that is left out of its mean (at least; identification finds its own)."""
    swept: bool = False
    """True for a ramp that is itself the measurement: after a pause it is retaken from `from_voltage`."""
    wait: Wait | None = None
    """Of a `rest` that waits for more than the propeller."""

    @property
    def number(self) -> int:
        """As people count the steps of a plan, from 1, wherever they read it; `index` is from 0, for programs."""
        return self.index + 1

    @property
    def doing(self) -> str:
        """Its phase, or `wait`, for people."""
        return self.phase if self.wait is None else "wait"

    @property
    def expected(self) -> float:
        """Seconds this step takes by plan. A hold until steady: half way between its bounds; a tare: one attempt."""
        return (self.min_duration + self.max_duration) / 2 if self.phase == "hold" else self.min_duration

    @property
    def measures(self) -> bool:
        """Whether the thrust in it is what the run is for; a tare is not."""
        return self.phase in ("hold", "sine") or self.swept

    @property
    def peak(self) -> float:
        """Largest |command| in V inside this step."""
        return max(abs(self.from_voltage) if self.phase == "ramp" else 0.0, abs(self.voltage) + abs(self.amplitude))


class Duration(NamedTuple):
    """s. `worst`: every hold to its maximum, every tare to its last attempt, every rest to its end."""

    expected: float
    worst: float


@dataclass(frozen=True, slots=True)
class TareConfig:
    """`[tare]`: rest measured before the sweep and at zero returns; refused when not stable. Raises PlanError."""

    duration: float = 3.0
    max_std_error: float = 0.05
    """N"""
    max_drift: float = 0.05
    """N/s"""
    attempts: int = 3

    def __post_init__(self) -> None:
        require_above_zero("duration", self.duration, "s")
        require_above_zero("max_std_error", self.max_std_error, "N")
        require_above_zero("max_drift", self.max_drift, "N/s")
        require(self.attempts >= 1, f"attempts must be at least 1, but is {self.attempts}")


LONGEST_RUN = 30 * 86_400.0
"""s expected: what takes longer was meant otherwise."""


@dataclass(frozen=True, slots=True)
class Plan:
    """A shape with its pacing. Iterating yields the steps of one run: tare, ramps and measurements, zero returns, zero.

    Each zero return is a ramp to 0, a rest of at least `rest` s until the propeller is at rest (at most
    `rest + coast_time` s), the wait before a tare where there is one, and a tare. There is one after every `zero_every`
    units (0: none) and always one at the end.
    Raises PlanError on impossible values.
    """

    shape: Shape
    dwell: Dwell
    slew: float
    """V/s of the ramps between levels."""
    repeats: int = 1
    zero_every: int = 0
    rest: float = 1.0
    coast_time: float = 3.0
    """s, longest wait for the propeller to come to rest in a zero return."""
    tare: TareConfig = field(default_factory=TareConfig)
    settle_water: float = 0.0
    """s at 0 V before each tare, for the water to come to rest."""
    settle_reversal: float = 0.0
    """s at 0 V where the direction changes between two moves without a zero return; 0: none."""
    cool_down: CoolDown | None = None

    def __post_init__(self) -> None:
        require_above_zero("slew", self.slew, "V/s")
        require_not_negative("settle_water", self.settle_water, "s")
        require_not_negative("settle_reversal", self.settle_reversal, "s")
        require(self.repeats >= 1, f"repeats must be at least 1, but is {self.repeats}")
        require(self.zero_every >= 0, f"zero_every must be at least 0 (0: no zero returns), but is {self.zero_every}")
        require_not_negative("rest", self.rest, "s")
        require_not_negative("coast_time", self.coast_time, "s")
        moves = tuple(move for unit in self.shape.units(1) for move in unit)
        require(
            len(moves) * self.repeats <= MOST_MOVES,
            f"{len(moves)} levels, sweeps or sines, {self.repeats} times over: at most {MOST_MOVES}, lower repeats",
        )
        for move in moves:
            require(
                steepest(move) <= self.slew * (1 + 1e-9),  # slack: float arithmetic only
                f"{_said(move)} needs {steepest(move):.3g} V/s, but the plan's slew is {self.slew:g} V/s: "
                "lower it or raise slew",
            )
            if isinstance(move, Hold) and move.duration is not None:
                require(
                    self.dwell.settle < move.duration,
                    f"dwell.settle ({self.dwell.settle:g} s) must be shorter than each of durations, but one is "
                    f"{move.duration:g} s",
                )

        seconds = self.duration().expected
        require(
            seconds <= LONGEST_RUN, f"a run would take {seconds:.3g} s, and {LONGEST_RUN:g} s are allowed: shorten it"
        )

    def __iter__(self) -> Iterator[Step]:
        return (replace(step, index=index) for index, step in enumerate(self._sequence()))

    def _sequence(self) -> Iterator[Step]:
        units = tuple(self.shape.units(self.repeats))
        at = way = 0.0
        yield from self._tared(self.cool_down)
        for count, unit in enumerate(units, start=1):
            for move in unit:
                start, end = ends(move)
                if self.settle_reversal and start * way < 0:
                    yield from self._travel(at, 0.0)
                    yield _waiting(Wait(self.settle_reversal))
                    at = 0.0
                yield from self._travel(at, start)
                yield self._measure(move)
                at, way = end, end or start or way
            if count == len(units) or (self.zero_every and count % self.zero_every == 0):
                yield from self._zero_return(at, None if count == len(units) else self.cool_down)
                at = way = 0.0

    def _travel(self, start: float, end: float) -> Iterator[Step]:
        if start != end:
            seconds = abs(end - start) / self.slew
            yield Step(0, "ramp", end, seconds, seconds, from_voltage=start)

    def _measure(self, move: Move) -> Step:
        match move:
            case Hold(voltage, seconds):
                bounds = self.dwell.bounds if seconds is None else (seconds, seconds)
                return Step(0, "hold", voltage, *bounds, settle=self.dwell.settle)
            case Sweep(start, end, rate):
                seconds = abs(end - start) / rate
                return Step(0, "ramp", end, seconds, seconds, from_voltage=start, swept=True)
            case Wave(offset, amplitude, frequency, cycles):
                seconds = cycles / frequency
                return Step(0, "sine", offset, seconds, seconds, amplitude=amplitude, frequency=frequency)

    def _zero_return(self, at: float, cool: CoolDown | None) -> Iterator[Step]:
        yield from self._travel(at, 0.0)
        yield Step(0, "rest", 0.0, self.rest, self.rest + self.coast_time)
        yield from self._tared(cool)

    def _tared(self, cool: CoolDown | None) -> Iterator[Step]:
        """In water at rest, by a motor that is cool where that is asked for: after the last move it need not be."""
        wait = wanted(self.settle_water, cool)
        if wait is not None:
            yield _waiting(wait)
        yield self._tare_step()

    def _tare_step(self) -> Step:
        return Step(0, "tare", 0.0, self.tare.duration, self.tare.duration * self.tare.attempts)

    def after(self, done: Set[int]) -> tuple[Step, ...]:
        """The steps of a run of which those with the indices `done` were measured before: a tare, then what is left.

        All steps when nothing is done; none when nothing is left. To a level that the left out steps went to, the
        sequencer goes by a ramp of its own.
        """
        left = tuple(step for step in self if step.index not in done)
        if not done or not left:
            return left
        while left and left[0].wait is not None:  # the tare has one of its own before it
            left = left[1:]
        tared = [replace(step, index=TARE_AGAIN) for step in self._tared(self.cool_down)]
        return (*(tared[:-1] if left and left[0].phase == "tare" else tared), *left)

    def duration(self) -> Duration:
        """Expected and worst duration of one run in s, without the watchdog proof."""
        steps = tuple(self)
        return Duration(sum(s.expected for s in steps), sum(s.max_duration for s in steps))

    def peak(self) -> float:
        """Largest |command| in V."""
        return max(step.peak for step in self)

    def require_within(self, max_voltage: float, slew: float, whose: str) -> None:
        """Raise PlanError when a step commands more than `max_voltage` V or the slew is over `slew` V/s of `whose`."""
        for step in self:
            require(
                step.peak <= max_voltage,
                f"step {step.number} ({step.phase}) commands {step.peak:g} V, but {whose} allows at most "
                f"{max_voltage:g} V: lower the plan's levels",
            )
        sentence = f"slew is {self.slew:g} V/s, but {whose} allows at most {slew:g} V/s: lower slew"
        require(self.slew <= slew, sentence)


def _waiting(wait: Wait) -> Step:
    return Step(0, "rest", 0.0, *wait.bounds, wait=wait)


def _said(move: Move) -> str:
    match move:
        case Wave(_, amplitude, frequency, _):
            return f"a sine of {amplitude:g} V at {frequency:g} Hz"
        case _:
            return f"a sweep at {steepest(move):g} V/s"
