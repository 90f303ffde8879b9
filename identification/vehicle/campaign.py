"""A whole campaign in the water: both steps on every axis that was driven, each axis told what the last one found."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal

import numpy as np

from identification.estimation.maximum_likelihood import NOTHING, Gaussian, independent
from identification.recording import Recording
from identification.thruster.thrust_data import Unusable
from identification.vehicle.efficiency import AXES, Installation
from identification.vehicle.inertia import InertiaFit, output_error, start_inertia
from identification.vehicle.inertia_by_derivative import smoothed
from identification.vehicle.steady_drag import DragFit, current_prior, identify_drag, passed_on
from identification.vehicle.trials import Trial, ballast_of, dominant_axis, holds, response_of, trial
from identification.velocity.constant_velocity import LEAST_SAMPLES

Step = Literal["steady", "moving"]
HELD = 0.5
"""Share of a recording in long holds above which it is one of constant-velocity runs, when it has no table of steps."""
FAR = 3.0
"""Standard deviations from what was stated beforehand that are worth a sentence."""
EMPTY: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True, eq=False)
class CampaignFacts:
    """What the campaign itself says of its recordings, by recording id; the rest follows from the commands."""

    ballast: Mapping[str, str] = field(default_factory=dict)
    """Heave: recordings of one ballast share a buoyancy; a recording that is not named has its own."""
    axis: Mapping[str, str] = field(default_factory=dict)
    step: Mapping[str, Step] = field(default_factory=dict)
    known: Mapping[str, Gaussian] = field(default_factory=dict)
    """axis -> parameters known from elsewhere: a weighed mass, a drag from a towing tank."""
    current: bool = True
    """Allow for a uniform current in surge and sway."""


@dataclass(frozen=True, eq=False)
class AxisTrials:
    """Recordings of one axis, apart by what they are for."""

    steady: tuple[Recording, ...] = ()
    moving: tuple[Recording, ...] = ()


@dataclass(frozen=True, eq=False)
class AxisResult:
    """Both steps of one axis; a sentence where a step could not be done."""

    axis: str
    drag: DragFit | Unusable
    inertia: InertiaFit | Unusable
    moving: tuple[Trial, ...] = ()
    """What step two was fitted to."""
    known: Gaussian = NOTHING
    """What step two was told."""
    ballast: Mapping[str, str] = field(default_factory=dict)
    """recording id -> buoyancy parameter of every recording, heave only."""
    stated: Gaussian = NOTHING
    """What the campaign knew of this axis from elsewhere."""

    @property
    def estimate(self) -> Gaussian | None:
        """The last word on every parameter: step two's, and the buoyancies that only step one has."""
        drag = NOTHING if isinstance(self.drag, Unusable) else self.drag.estimate
        if isinstance(self.inertia, Unusable):
            return drag if drag.names else None
        last = self.inertia.estimate
        return independent(last, drag.select([name for name in drag.names if name not in last.names]))

    @property
    def contradictions(self) -> tuple[str, ...]:
        """Parameters that came out far from what was stated of them beforehand."""
        estimate, out = self.estimate, []
        for name in self.stated.names if estimate is not None else ():
            before, std = self.stated[name], self.stated.std_of(name)
            if estimate is not None and name in estimate.names and abs(estimate[name] - before) > FAR * std:
                off = abs(estimate[name] - before) / std
                out.append(
                    f"{self.axis}: {name} = {estimate[name]:.3g} is {off:.0f} standard deviations from the "
                    f"{before:.4g} ± {std:.2g} stated: the model contradicts what is known"
                )
        return tuple(out)

    @property
    def statements(self) -> tuple[str, ...]:
        out: list[str] = list(self.contradictions)
        for found in (self.drag, self.inertia):
            out.extend([found.reason] if isinstance(found, Unusable) else found.statements)
        return tuple(out)


@dataclass(frozen=True, eq=False)
class VehicleFit:
    """All axes, in the order they were done."""

    axes: Mapping[str, AxisResult]
    trials: Mapping[str, AxisTrials]
    unused: tuple[str, ...] = ()
    """Recordings whose axis could not be told."""

    def sentences(self) -> Iterator[str]:
        for result in self.axes.values():
            yield from result.statements
        for name in self.unused:
            yield f"recording {name} was not used: no thruster of the lay-out was commanded in it"


@dataclass(frozen=True, eq=False)
class Sorted:
    """Recordings by axis."""

    axes: Mapping[str, AxisTrials] = field(default_factory=dict)
    unused: tuple[str, ...] = ()


NO_FACTS = CampaignFacts()


def step_of(recording: Recording, axis: str) -> Step:
    """`steady` for constant-velocity runs: holds in the table of steps, or long spans of constant command."""
    if recording.steps:
        return "steady" if any(step.phase == "hold" for step in recording.steps) else "moving"
    channel = response_of(recording, axis)
    if channel is None or channel.time.size < LEAST_SAMPLES:
        return "moving"
    ends = np.array(holds(recording))
    inside = np.diff(np.searchsorted(channel.time, ends), axis=1).ravel()
    long = inside >= LEAST_SAMPLES
    return "steady" if inside[long].sum() > HELD * channel.time.size else "moving"


def sort_trials(recordings: Sequence[Recording], installation: Installation, facts: CampaignFacts = NO_FACTS) -> Sorted:
    """By the axis that the commands push hardest and by step, where the campaign does not say."""
    found: dict[str, tuple[list[Recording], list[Recording]]] = {}
    unused = []
    for recording in recordings:
        pushed = dominant_axis(recording, installation)
        if pushed is None:
            unused.append(recording.source or recording.recording_id)
            continue
        axis = facts.axis.get(recording.recording_id, pushed)
        step = facts.step.get(recording.recording_id) or step_of(recording, axis)
        found.setdefault(axis, ([], []))[step == "moving"].append(recording)
    ordered = {axis: AxisTrials(*map(tuple, found[axis])) for axis in AXES if axis in found}
    return Sorted(ordered, tuple(unused))


def identify_vehicle(
    recordings: Sequence[Recording], installation: Installation, facts: CampaignFacts = NO_FACTS
) -> VehicleFit:
    """Both steps on every axis. Surge comes first: only there groups of thrusters are driven apart."""
    ordered = sort_trials(recordings, installation, facts)
    results: dict[str, AxisResult] = {}
    known = NOTHING
    for axis, trials in ordered.axes.items():
        result = identify_axis(trials, installation, axis, known if axis != "heave" else NOTHING, facts)
        results[axis] = result
        if axis != "heave" and not isinstance(result.drag, Unusable):
            known = passed_on(result.drag)
    return VehicleFit(results, ordered.axes, ordered.unused)


def identify_axis(
    trials: AxisTrials,
    installation: Installation,
    axis: str,
    known: Gaussian = NOTHING,
    facts: CampaignFacts = NO_FACTS,
) -> AxisResult:
    """Step one, then step two with what it found; without constant-velocity runs everything from the trials at once.

    `known`: what another axis has passed on.
    """
    stated = facts.known.get(axis, NOTHING)
    told = independent(known, stated.select([name for name in stated.names if name not in known.names]))
    names = [r.recording_id for r in (*trials.steady, *trials.moving)]
    ballast = ballast_of(names, facts.ballast) if axis == "heave" else {}
    drag = identify_drag(trials.steady, installation, axis, told, current=facts.current, experiments=facts.ballast)
    made = [trial(recording, installation, axis) for recording in trials.moving]
    moving = tuple(one for one in made if isinstance(one, Trial))
    refused = "; ".join(one.reason for one in made if isinstance(one, Unusable))
    reason = "drag and efficiency are not known" if moving else refused or "no sine-force trial was given"
    nothing = Unusable(f"{axis}: inertia not identified: {reason}")
    first = AxisResult(axis, drag, nothing, moving, ballast=ballast, stated=stated)
    if moving and isinstance(drag, Unusable):
        why = drag if trials.steady else Unusable(f"{axis}: no constant-velocity run: all from the trials at once")
        found = at_once(moving, installation, told, ballast, facts.current)
        return replace(first, drag=why, inertia=found, known=told)
    if not moving or isinstance(drag, Unusable) or drag.maximum.deficiency is not None:
        return first
    mass = told.select([name for name in told.names if name == "m"])
    last, step_one = step_two(moving, drag, ballast, mass)
    return replace(first, inertia=last, known=step_one)


def step_two(
    moving: Sequence[Trial], drag: DragFit, ballast: Mapping[str, str], mass: Gaussian = NOTHING
) -> tuple[InertiaFit | Unusable, Gaussian]:
    """Inertia by output error, everything step one found carried in; a ballast it did not have is fitted too.

    `mass`: an inertia known from elsewhere. Returns what step two was told, too.
    """
    wanted = {ballast[one.recording_id] for one in moving if one.recording_id in ballast}
    names = [n for n in drag.estimate.names if not n.startswith("buoyancy") or n in wanted]
    known = independent(drag.estimate.select(names), mass)
    free = {"m": mass["m"] if mass.names else start_inertia(moving, known, ballast)}
    free |= dict.fromkeys(sorted(wanted - set(names)), 0.0)
    return output_error(moving, known, free, ballast), known


def at_once(
    moving: Sequence[Trial],
    installation: Installation,
    told: Gaussian = NOTHING,
    ballast: Mapping[str, str] = EMPTY,
    current: bool = True,
) -> InertiaFit | Unusable:
    """Inertia, drag, efficiencies, current and buoyancies from moving trials alone, by output error.

    `told`: parameters known beforehand. What the trials cannot tell apart is said by the fit.
    """
    axis = moving[0].axis
    in_force = tuple(dict.fromkeys(name for one in moving for name in one.force.parameters))
    if not any(np.any(one.force.nominal() != 0) for one in moving):
        return Unusable(f"{axis}: no trial has a force on that axis")
    rest = installation.known(name for name in in_force if name not in told.names)
    flow = current_prior(told) if current and axis in ("surge", "sway") else NOTHING
    relevant = (*in_force, "m", "k", "k2", "current_north", "current_east")
    known = independent(told.select([n for n in told.names if n in relevant]), rest, flow)
    free = _first_guess(moving)
    free |= {name: 0.8 for name in in_force if name in installation.etas}
    free |= {ballast[one.recording_id]: 0.0 for one in moving if one.recording_id in ballast}
    free |= {name: known[name] for name in free if name in known.names}
    return output_error(moving, known, free, ballast)


def _first_guess(moving: Sequence[Trial]) -> dict[str, float]:
    """m, k and k2 to start from: half of the largest force is lost to each drag at the largest speed."""
    ready = [found for one in moving if (found := smoothed(one)) is not None]
    speed = max((float(np.abs(found.velocity).max()) for found in ready), default=1.0) or 1.0
    push = max(float(np.abs(one.force.nominal()).max()) for one in moving)
    drag = {"k": 0.5 * push / speed, "k2": 0.5 * push / speed**2}
    guess = Gaussian(("k", "k2"), np.array(list(drag.values())), np.eye(2))
    return {"m": start_inertia(moving, guess, {}), **drag}
