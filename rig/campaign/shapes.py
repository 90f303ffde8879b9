"""Shapes of a sweep: which voltages, sweeps or sines are measured, in which order. `plan` puts the rest between."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isfinite, pi
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np

from rig.errors import PlanError

MOST_MOVES = 10_000
"""Of one run; of 10 s each they take a day."""
MOST_CYCLES = 1_000_000


def require(passed: bool, sentence: str) -> None:
    """Raise PlanError with `sentence` unless `passed`."""
    if not passed:
        raise PlanError(sentence)


def require_above_zero(key: str, value: float, unit: str) -> None:
    """Refuse a number of a campaign that is not above 0, by its key and unit. Raises PlanError."""
    require(isfinite(value) and value > 0, f"{key} must be a number above 0 {unit}, but is {value:g}")


def require_not_negative(key: str, value: float, unit: str) -> None:
    """Refuse a number of a campaign that is below 0, by its key and unit. Raises PlanError."""
    require(isfinite(value) and value >= 0, f"{key} must be a number of at least 0 {unit}, but is {value:g}")


class Hold(NamedTuple):
    """A constant voltage (V) for `duration` s, or for one dwell of the plan."""

    voltage: float
    duration: float | None = None


class Sweep(NamedTuple):
    """A ramp that is itself the measurement: V, V, V/s."""

    start: float
    end: float
    rate: float


class Wave(NamedTuple):
    """Whole cycles of `offset + amplitude sin(2 pi frequency t)`: V, V, Hz."""

    offset: float
    amplitude: float
    frequency: float
    cycles: int


Move = Hold | Sweep | Wave
Unit = tuple[Move, ...]
"""Moves that no zero return may part."""


class Shape(Protocol):
    """What a plan kind is: the moves of the whole sweep, `repeats` times over."""

    def units(self, repeats: int) -> Iterator[Unit]: ...


def _ladder(lowest: float | None, highest: float, levels: int) -> tuple[float, ...]:
    """`levels` equal steps up to `highest` V, from `lowest` (default `highest / levels`)."""
    require_above_zero("max", highest, "V")
    require(levels >= 1, f"levels must be at least 1, but is {levels}: a plan without levels measures nothing")
    require(levels <= MOST_MOVES, f"levels must be at most {MOST_MOVES}, but is {levels}")
    first = highest / levels if lowest is None else lowest
    require_above_zero("min", first, "V")
    require(first <= highest, f"min ({first:g} V) must not exceed max ({highest:g} V)")
    return tuple(float(v) for v in np.linspace(first if levels > 1 else highest, highest, levels))


def _holds(voltages: tuple[float, ...]) -> Iterator[Unit]:
    return ((Hold(v),) for v in voltages)


@dataclass(frozen=True, slots=True)
class Staircase:
    """Up to `max` and down again, then the same on the other side: shows hysteresis. Levels are per sign."""

    max: float
    levels: int
    min: float | None = None
    sides: Literal["both", "forward", "reverse"] = "both"

    def __post_init__(self) -> None:
        _ladder(self.min, self.max, self.levels)

    def units(self, repeats: int) -> Iterator[Unit]:
        up = _ladder(self.min, self.max, self.levels)
        stairs = up + up[-2::-1]
        signs = {"both": (1.0, -1.0), "forward": (1.0,), "reverse": (-1.0,)}[self.sides]
        return _holds(tuple(sign * v for _ in range(repeats) for sign in signs for v in stairs))


@dataclass(frozen=True, slots=True)
class Interleaved:
    """V, -V alternating with growing |V|: keeps drift apart from forward/reverse asymmetry. Levels are per sign."""

    max: float
    levels: int
    min: float | None = None

    def __post_init__(self) -> None:
        _ladder(self.min, self.max, self.levels)

    def units(self, repeats: int) -> Iterator[Unit]:
        up = _ladder(self.min, self.max, self.levels)
        return _holds(tuple(sign * v for _ in range(repeats) for v in up for sign in (1.0, -1.0)))


@dataclass(frozen=True, slots=True)
class RandomOrder:
    """The levels of both signs in an order drawn from `seed`, drawn anew in each repeat. Levels are per sign."""

    max: float
    levels: int
    seed: int
    min: float | None = None

    def __post_init__(self) -> None:
        _ladder(self.min, self.max, self.levels)
        require(self.seed >= 0, f"seed must be at least 0, but is {self.seed}")

    def units(self, repeats: int) -> Iterator[Unit]:
        up = _ladder(self.min, self.max, self.levels)
        both = np.array(up + tuple(-v for v in up))
        rng = np.random.default_rng(self.seed)
        return _holds(tuple(float(v) for _ in range(repeats) for v in rng.permutation(both)))


@dataclass(frozen=True, slots=True)
class Levels:
    """The voltages as written, in that order; 0 V is a level like another. `durations` (s each) replace the dwell."""

    voltages: tuple[float, ...]
    durations: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        require(len(self.voltages) > 0, "voltages must hold at least one level: a plan without levels measures nothing")
        for v in self.voltages:
            require(isfinite(v), f"voltages must be finite numbers in V, but one is {v:g}")
        require(
            len(self.durations) in {0, len(self.voltages)},
            f"durations must hold one number for each of the {len(self.voltages)} voltages, but holds "
            f"{len(self.durations)}",
        )
        for seconds in self.durations:
            require_above_zero("durations", seconds, "s")

    def units(self, repeats: int) -> Iterator[Unit]:
        if not self.durations:
            return _holds(self.voltages * repeats)
        return iter(tuple((Hold(v, s),) for v, s in zip(self.voltages, self.durations, strict=True)) * repeats)


@dataclass(frozen=True, slots=True)
class Ramp:
    """A continuous triangle 0, +max, -max, 0 at `rate` V/s."""

    max: float
    rate: float

    def __post_init__(self) -> None:
        require_above_zero("max", self.max, "V")
        require_above_zero("rate", self.rate, "V/s")

    def units(self, repeats: int) -> Iterator[Unit]:
        top, rate = self.max, self.rate
        triangle = (Sweep(0.0, top, rate), Sweep(top, -top, rate), Sweep(-top, 0.0, rate))
        return (triangle for _ in range(repeats))


@dataclass(frozen=True, slots=True)
class Sine:
    """Whole sine cycles about `offset` V, one block per frequency (Hz): shows lag and inertia."""

    amplitude: float
    frequencies: tuple[float, ...]
    cycles: int
    offset: float = 0.0

    def __post_init__(self) -> None:
        require_above_zero("amplitude", self.amplitude, "V")
        require(len(self.frequencies) > 0, "frequencies must hold at least one frequency in Hz")
        for frequency in self.frequencies:
            require_above_zero("frequencies", frequency, "Hz")
        require(self.cycles >= 1, f"cycles must be at least 1, but is {self.cycles}")
        require(self.cycles <= MOST_CYCLES, f"cycles must be at most {MOST_CYCLES}, but is {self.cycles}")
        require(isfinite(self.offset), f"offset must be a finite number in V, but is {self.offset:g}")

    def units(self, repeats: int) -> Iterator[Unit]:
        waves = tuple(Wave(self.offset, self.amplitude, f, self.cycles) for f in self.frequencies)
        return ((wave,) for _ in range(repeats) for wave in waves)


def ends(move: Move) -> tuple[float, float]:
    """Command in V at the start and at the end of a move."""
    match move:
        case Hold(voltage, _):
            return voltage, voltage
        case Sweep(start, end, _):
            return start, end
        case Wave(offset, _, _, _):
            return offset, offset


def steepest(move: Move) -> float:
    """Largest |dV/dt| in V/s inside a move: a sine's is 2 pi f A."""
    match move:
        case Hold():
            return 0.0
        case Sweep(_, _, rate):
            return rate
        case Wave(_, amplitude, frequency, _):
            return 2 * pi * frequency * amplitude


SHAPES: Mapping[str, type[Any]] = MappingProxyType(
    {
        "staircase": Staircase,
        "interleaved": Interleaved,
        "random": RandomOrder,
        "levels": Levels,
        "ramp": Ramp,
        "sine": Sine,
    }
)
"""`[plan] kind` -> shape."""
