"""What a design is measured against: the plain staircase and the interleaved plan of the same time, and any plan."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from identification.experiment_design.run_order import Exposure, exposure
from identification.experiment_design.thrust_design import Means, Promise, promise
from rig.campaign.dwell import FixedDwell
from rig.campaign.plan import Plan, Step, TareConfig
from rig.campaign.shapes import Interleaved, Shape, Staircase
from rig.design.optimal_levels import Ask, mean_heat
from rig.design.plan import worth

LEVELS = 6
"""Per sign, of the plain plans."""


@dataclass(frozen=True, eq=False)
class Judged:
    """A plan, and what its fit will know."""

    name: str
    promise: Promise
    value: float
    """Of the criterion, see `design_plan.worth`."""
    exposure: Exposure
    heat: float
    """Mean, 1 being that at the highest level allowed."""
    total: float
    """s"""


def means_of(steps: Iterable[Step]) -> tuple[Means, float]:
    """Means of holds and tares of a plan, by its expected times, and the plan's time in s."""
    at, rows = 0.0, []
    for step in steps:
        end = at + step.expected
        if step.phase in {"hold", "tare"}:
            settle = step.settle if step.phase == "hold" else 0.0
            rows.append((step.voltage, step.expected - settle, (at + settle + end) / 2))
        at = end
    voltage, seconds, middle = np.array(rows).T
    return Means(voltage, seconds, middle), at


def judge(name: str, plan: Plan, ask: Ask) -> Judged | None:
    """None when the plan cannot tell the parameters apart."""
    steps = tuple(plan)
    means, total = means_of(steps)
    found = promise(means, ask.terms, ask.noise)
    if not isinstance(found, Promise):
        return None
    holds = [step for step in steps if step.phase == "hold"]
    V, dwells = np.array([s.voltage for s in holds]), np.array([s.expected for s in holds])
    return Judged(
        name,
        found,
        worth(found, ask.criterion, ask.terms.size(ask.V_max)),
        exposure(means, ask.terms, ask.noise, ask.setting.slow, ask.V_max, total),
        mean_heat(V, dwells, ask.course, ask.V_max),
        total,
    )


def plain_plans(ask: Ask, tare: TareConfig) -> tuple[Judged, ...]:
    """Staircase and interleaved plan with LEVELS levels per sign over the same range, in the same time."""
    low, high = float(ask.candidates.min()), float(ask.candidates.max())
    if low < 0 < high:
        top = min(-low, high)
        shapes: dict[str, Shape] = {"staircase": Staircase(top, LEVELS), "interleaved": Interleaved(top, LEVELS)}
    else:
        shapes = {"staircase": Staircase(ask.V_max, LEVELS, sides="forward" if high > 0 else "reverse")}
    plans = {name: filling(shape, ask, tare) for name, shape in shapes.items()}
    judged = [judge(name, plan, ask) for name, plan in plans.items() if plan is not None]
    return tuple(found for found in judged if found is not None)


def filling(shape: Shape, ask: Ask, tare: TareConfig) -> Plan | None:
    """As few repeats as the longest dwell allows; None when the time is too short for one."""
    repeats = 1
    while True:
        plan = _paced(shape, ask, tare, repeats, ask.max_dwell)
        holds = sum(step.phase == "hold" for step in plan)
        dwell = ask.max_dwell - (plan.duration().expected - ask.total) / holds
        if dwell <= ask.max_dwell:
            break
        repeats += 1
    return _paced(shape, ask, tare, repeats, dwell) if dwell > ask.course.settle + ask.least_mean / 2 else None


def _paced(shape: Shape, ask: Ask, tare: TareConfig, repeats: int, dwell: float) -> Plan:
    course = ask.course
    pace = FixedDwell(dwell, course.settle)
    return Plan(shape, pace, course.slew, repeats, course.zero_every, course.rest, tare=tare)
