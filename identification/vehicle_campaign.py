"""A whole campaign in the water: both steps on every axis that was driven, each axis told what the last one found."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from identification.efficiency import AXES, Installation
from identification.inertia import InertiaFit, output_error, start_inertia
from identification.maximum_likelihood import NOTHING, Gaussian
from identification.recording import Recording
from identification.thrust_data import Unusable
from identification.vehicle import DragFit, identify_drag, passed_on
from identification.vehicle_trials import Trial, dominant_axis, trial


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

    @property
    def statements(self) -> tuple[str, ...]:
        out: list[str] = []
        for found in (self.drag, self.inertia):
            out.extend([found.reason] if isinstance(found, Unusable) else found.statements)
        return tuple(out)


@dataclass(frozen=True, eq=False)
class VehicleFit:
    """All axes, in the order they were done."""

    axes: Mapping[str, AxisResult]
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


def sort_trials(recordings: Sequence[Recording], installation: Installation) -> Sorted:
    """By the axis that the commands push hardest; a recording with holds is for step one, any other for step two."""
    found: dict[str, tuple[list[Recording], list[Recording]]] = {}
    unused = []
    for recording in recordings:
        axis = dominant_axis(recording, installation)
        if axis is None:
            unused.append(recording.source or recording.recording_id)
            continue
        steady = any(step.phase == "hold" for step in recording.steps)
        found.setdefault(axis, ([], []))[0 if steady else 1].append(recording)
    ordered = {axis: AxisTrials(*map(tuple, found[axis])) for axis in AXES if axis in found}
    return Sorted(ordered, tuple(unused))


def identify_vehicle(
    recordings: Sequence[Recording], installation: Installation, experiments: Mapping[str, str] | None = None
) -> VehicleFit:
    """Both steps on every axis. Surge comes first: only there groups of thrusters are driven apart.

    `experiments`: recording id -> ballast (heave).
    """
    ordered = sort_trials(recordings, installation)
    results: dict[str, AxisResult] = {}
    known = NOTHING
    for axis, trials in ordered.axes.items():
        told = known if axis != "heave" else NOTHING
        result = identify_axis(trials, installation, axis, told, experiments or {})
        results[axis] = result
        if axis != "heave" and not isinstance(result.drag, Unusable):
            known = passed_on(result.drag)
    return VehicleFit(results, ordered.unused)


def identify_axis(
    trials: AxisTrials, installation: Installation, axis: str, known: Gaussian, experiments: Mapping[str, str]
) -> AxisResult:
    """Step one, then step two with what it found."""
    drag = identify_drag(trials.steady, installation, axis, known, experiments=experiments)
    if isinstance(drag, Unusable):
        return AxisResult(axis, drag, Unusable(f"{axis}: no inertia without drag (step one)"))
    made = [trial(recording, installation, axis) for recording in trials.moving]
    moving = [one for one in made if isinstance(one, Trial)]
    if not moving:
        refused = "; ".join(one.reason for one in made if isinstance(one, Unusable))
        reason = refused or "no sine-force trial was given"
        return AxisResult(axis, drag, Unusable(f"{axis}: inertia not identified: {reason}"))
    if drag.maximum.deficiency is not None:
        return AxisResult(axis, drag, Unusable(f"{axis}: inertia not identified: drag and efficiency are not known"))
    return AxisResult(axis, drag, step_two(moving, drag, experiments))


def step_two(moving: Sequence[Trial], drag: DragFit, experiments: Mapping[str, str]) -> InertiaFit | Unusable:
    """Inertia by output error, everything step one found carried in; a ballast it did not have is fitted too."""
    ballast: dict[str, str] = {}
    if drag.axis == "heave":
        ballast = {
            one.recording_id: f"buoyancy[{experiments.get(one.recording_id, one.recording_id)}]" for one in moving
        }
    wanted = set(ballast.values())
    names = [n for n in drag.estimate.names if not n.startswith("buoyancy") or n in wanted]
    known = drag.estimate.select(names)
    free = {"m": start_inertia(moving, known, ballast)}
    free |= dict.fromkeys(sorted(wanted - set(names)), 0.0)
    return output_error(moving, known, free, ballast)
