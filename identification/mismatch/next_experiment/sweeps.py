"""What may be asked of a bench, and the pieces that a sweep is put together from: holds of round volts and seconds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, groupby

import numpy as np

from identification.mismatch.diagnosis import PlanStep

BUDGET = 300.0
"""s of a next experiment, if nobody says otherwise."""
QUANTUM = 200.0
"""Levels are multiples of a round number that is about the largest driver divided by this."""
REST = 3.0
"""s at 0 V with which a sweep begins and ends."""
LEVELS = (0.04, 0.07, 0.1, 0.15, 0.2, 0.27, 0.35, 0.45, 0.55, 0.65, 0.75, 0.81, 0.87, 0.93, 0.97, 0.985, 1.0)
"""Shares of the largest driver that are held singly, both ways."""
HOLD = 3.0
"""s of each."""
SHORT = 40.0
"""s: a longer piece leaves water and winding warm or moving."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Of the bench. What is None is taken from the recordings: what was run once can be run again."""

    max_voltage: float | None = None
    """Largest |command|, V; nothing beyond the largest that was recorded is proposed either way."""
    budget: float = BUDGET
    """s of the whole sweep."""
    flow_speeds: tuple[float, ...] | None = None
    """m/s that can be set; None: those that were recorded."""
    slew: float | None = None
    """V/s between levels; None: the steepest that was recorded; inf: at once."""
    max_thrust: float | None = None
    """N that the stand bears; None: no limit beside the voltage."""


@dataclass(frozen=True, slots=True)
class Block:
    """One piece of a sweep: (command in V, s) of each hold, all at one flow speed."""

    name: str
    """Empty: a level held both ways."""
    holds: tuple[tuple[float, float], ...]
    flow: float = 0.0

    @property
    def seconds(self) -> float:
        return sum(seconds for _, seconds in self.holds)


def round_level(volts: float, largest: float) -> float:
    """To a multiple of 1, 2 or 5 times a power of ten that is about largest / QUANTUM.

    >>> round_level(3.27, 24.0), round_level(0.333, 5.0)
    (3.3, 0.34)
    """
    wanted = largest / QUANTUM
    ten = 10.0 ** np.floor(np.log10(wanted))
    step = ten * max(m for m in (1.0, 2.0, 5.0) if m * ten <= wanted * (1 + 1e-9))
    most = np.floor(largest / step * (1 + 1e-9))  # to round up would go beyond the largest
    return float(round(float(np.clip(round(volts / step), -most, most)) * step, 6))


def blocks(largest: float, flows: Sequence[float] = ()) -> tuple[Block, ...]:
    """All pieces for a driver of at most `largest` and flow speeds beside 0 in m/s."""
    still = [_block(name, shares, largest) for name, shares in _shapes()]
    moving = [
        _block(f"{name} in a flow of {flow:g} m/s", shares, largest, flow)
        for flow in flows
        for name, shares in _flow_shapes()
    ]
    return (*still, *moving)


Shares = Sequence[tuple[float, float]]
"""(share of the largest driver, s) of each hold."""


def _block(name: str, shares: Shares, largest: float, flow: float = 0.0) -> Block:
    holds = [(round_level(share * largest, largest), seconds) for share, seconds in shares]
    return Block(name, tuple(holds), flow)


def _both(sizes: Sequence[float], seconds: float) -> Shares:
    """Each size forwards, then backwards."""
    return [(sign * size, seconds) for size in sizes for sign in (1.0, -1.0)]


def _triangle(top: float, steps: int, seconds: float) -> Shares:
    up = np.linspace(0.0, top, steps + 1)
    course = np.concatenate([up[1:], up[-2::-1], -up[1:], -up[-2::-1]])
    return [(float(share), seconds) for share in course]


def _shapes() -> Iterator[tuple[str, Shares]]:
    """In the order in which they are run: small and short first, minutes of load last."""
    rest = (0.0, REST)
    yield "fine levels round 0", [rest, *_both((0.02, 0.05, 0.08, 0.11), 2.0), rest]
    for share in LEVELS:
        yield "", _both((share,), HOLD)
    yield "zero", [rest]
    yield "slow small triangle", [rest, *_triangle(0.25, 10, 1.0)]
    yield "quick small steps", [rest, *((s, 1.0) for s in (0.1, 0.3, 0.1, 0.2, 0.0, -0.1, -0.3, -0.1, -0.2, 0.0))]
    yield "quick large steps", [rest, *((s, 1.0) for s in (1.0, 0.0, 0.5, 1.0, 0.5, 0.0, -1.0, 0.0, -0.5, -1.0, 0.0))]
    yield "up and down", [rest, *_triangle(1.0, 5, 2.0)]
    yield "the same level from above and below", [(s, 3.0) for s in (0.5, 1.0, 0.5, 0.0, 0.5, -0.5, -1.0, -0.5, 0.0)]
    yield "reversals at once", [rest, *_both((0.6, 0.6, 0.6), 3.0)]
    yield (
        "reversals after rests",
        [(0.6, 3.0), (0.0, 1.0), (-0.6, 3.0), (0.0, 4.0), (0.6, 3.0), (0.0, 8.0), (-0.6, 3.0)],
    )
    yield "rest", [(0.0, 60.0)]
    yield "one level before and after a rest", [(0.5, 4.0), (0.0, 60.0), (0.5, 4.0), rest]
    yield "load and rest", [rest, (0.7, 20.0), (0.0, 40.0)]
    yield "the other way loaded, then rest", [rest, (-0.7, 20.0), (0.0, 40.0)]
    yield "long load in turn", [rest, (0.7, 20.0), (-0.7, 20.0), (0.7, 20.0), (-0.7, 20.0), rest]
    yield "long load, then rest", [rest, (0.7, 60.0), (0.4, 10.0), (0.0, 50.0)]
    late = [(0.4, 5.0), (0.0, 20.0)] * 2
    yield "large load, then a level after rests", [rest, (0.4, 5.0), (0.0, REST), (0.9, 40.0), *late, (0.4, 5.0), rest]


def _flow_shapes() -> Iterator[tuple[str, Shares]]:
    rest = (0.0, REST)
    yield "small levels", [rest, *_both((0.1, 0.2, 0.35), HOLD)]
    yield "wide levels", [rest, *_both((0.3, 0.6, 0.9), HOLD)]


def put_together(chosen: Sequence[Block], every: Sequence[Block]) -> tuple[PlanStep, ...]:
    """The steps of the chosen pieces: one stretch for each flow speed, still water first.

    Pieces that are repeated come in rounds, each in the order of `every`: what drifts does not look like a level.
    A rest that follows a rest is not made twice, the longer one stays. Each stretch begins and ends at rest.
    """
    rank = {block: i for i, block in enumerate(every)}
    count: dict[Block, int] = {}
    placed = []
    for block in chosen:
        count[block] = count.get(block, 0) + 1
        placed.append((block.flow != 0.0, block.flow, count[block], rank[block], block))
    ordered = [entry[-1] for entry in sorted(placed, key=lambda entry: entry[:-1])]
    steps: list[PlanStep] = []
    for flow, part in groupby(ordered, key=lambda block: block.flow):
        rest = [(0.0, REST)]
        for volts, seconds in chain(rest, *(block.holds for block in part), rest):
            if steps and steps[-1].command_voltage == volts and steps[-1].flow_speed == flow:
                before = steps.pop().duration
                steps.append(PlanStep(volts, max(seconds, before) if volts == 0.0 else seconds + before, flow))
            else:
                steps.append(PlanStep(volts, seconds, flow))
    return tuple(steps)
