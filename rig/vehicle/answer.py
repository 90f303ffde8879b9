"""What `rig vehicle` finds: the identified vehicle, its trials simulated, and recordings held out simulated too."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from identification.comparators.rivals import rivals
from identification.estimation.maximum_likelihood import NOTHING, Gaussian, independent
from identification.recording import Recording
from identification.thruster.thrust_data import Unusable
from identification.vehicle.campaign import AxisResult, CampaignFacts, VehicleFit, identify_vehicle, sort_trials
from identification.vehicle.efficiency import Installation
from identification.vehicle.inertia import InertiaFit
from identification.vehicle.replay import Replay, replay
from identification.vehicle.trials import Trial, ballast_of, trial
from rig.errors import ConfigError, RecordingError
from rig.vehicle.installation import InstallationFile, Vehicle, load_installation
from rig.vehicle.recordings import Named, check, load_named, matched
from rig.vehicle.thrusters import Calibration, installed, read_fits, straight_ahead

REPLAY_STEP = 0.5
"""s of the force grid in which long recordings are simulated again; vehicles have time constants of seconds."""


@dataclass(frozen=True, eq=False)
class HeldOut:
    """A recording that was not fitted, simulated by the vehicle as identified and by one without efficiencies."""

    name: str
    axis: str
    replay: Replay
    without: Replay | None
    """None when the installation has no efficiency, or without one nothing was identified on that axis."""
    note: str = ""


@dataclass(frozen=True, eq=False)
class VehicleAnswer:
    """Everything `rig vehicle` found; text, JSON and report are made of this alone."""

    vehicle: str
    recordings: tuple[Named, ...]
    installation: Installation
    calibrations: Mapping[str, Calibration]
    """thruster -> what the tunnel said of it; those with a stated C or a curve have none."""
    fit: VehicleFit
    replays: Mapping[str, tuple[Replay, ...]]
    """axis -> every recording of it, simulated by the identified vehicle."""
    held_out: tuple[HeldOut, ...] = ()
    comparators: Mapping[str, tuple[InertiaFit | Unusable, ...]] = field(default_factory=dict)
    """axis -> other ways to the inertia."""
    without: VehicleFit | None = None
    """The vehicle identified as if every efficiency were 1, when recordings were held out."""
    notes: tuple[str, ...] = ()


def identify_files(
    paths: Sequence[Path],
    thrusters: Sequence[Path] = (),
    installation: Path | None = None,
    holdout: Sequence[Path] = (),
    comparators: bool = False,
) -> VehicleAnswer:
    """Load, check and identify. Raises RigError with one sentence for input that cannot be used."""
    named = load_named(paths)
    if not named:
        raise RecordingError("no recording was given; expected one or more *.h5 files of vehicle trials")
    kept = load_named(holdout, named)
    fits = read_fits(thrusters)
    file, notes = _file(installation, named)
    lay_out = installed(file, fits)
    facts = _facts(file, [one.name for one in (*named, *kept)])
    for one in (*named, *kept):
        notes += check(one, lay_out, facts.axis.get(one.name, ""))
    recordings = [one.recording for one in named]
    fit = identify_vehicle(recordings, lay_out, facts)
    _require_something(fit)
    bare = replace(lay_out, interactions=())
    plain = identify_vehicle(recordings, bare, facts) if kept and lay_out.interactions else None
    return VehicleAnswer(
        vehicle=file.vehicle.name or named[0].recording.thruster,
        recordings=named,
        installation=lay_out,
        calibrations={name: fits[m.fit or name] for name, m in file.thrusters.items() if (m.fit or name) in fits},
        fit=fit,
        replays={axis: _replays(recordings, lay_out, result, fit) for axis, result in fit.axes.items()},
        held_out=_held_out(kept, lay_out, facts, fit, plain) if kept else (),
        without=plain,
        comparators=_comparators(fit) if comparators else {},
        notes=notes,
    )


def _file(path: Path | None, named: Sequence[Named]) -> tuple[InstallationFile, tuple[str, ...]]:
    """The installation file, or what can be assumed without one."""
    if path is not None:
        return load_installation(path), ()
    mounted = straight_ahead([one.recording for one in named])
    if not mounted:
        raise ConfigError(
            "--installation was not given, and the recordings do not tell along which axis each thruster pushes: their "
            "command_voltage channels need the attribute thruster, and one axis of motion; docs/howto/vehicle.md shows "
            "an installation file"
        )
    told = ", ".join(f"{name} in {' and '.join(a for a, arm in m.arms.items() if arm)}" for name, m in mounted.items())
    note = f"no installation file: each thruster is taken to push straight ahead with all of its thrust: {told}"
    return InstallationFile(Path("(no --installation)"), "", Vehicle(), mounted), (note,)


def _facts(file: InstallationFile, names: Sequence[str]) -> CampaignFacts:
    """What the file says, by recording. Raises ConfigError for a table of trials that no file belongs to."""
    strangers = [pattern for pattern in file.trials if not matched(names, {pattern: True})]
    if strangers and len(strangers) == len(file.trials):
        raise ConfigError(
            f'{file.path}: [trials."{strangers[0]}"] is the name of no file; there are {", ".join(names)}'
        )
    said = matched(names, file.trials)
    known = {
        axis: Gaussian(
            tuple(stated),
            np.array([one.value for one in stated.values()]),
            np.diag([one.std**2 for one in stated.values()]),
        )
        for axis, stated in file.known.items()
        if stated
    }
    return CampaignFacts(
        ballast={name: one.ballast for name, one in said.items() if one.ballast},
        axis={name: one.axis for name, one in said.items() if one.axis},
        step={name: one.step for name, one in said.items() if one.step},
        known=known,
        current=file.vehicle.current,
    )


def _require_something(fit: VehicleFit) -> None:
    """Raise RecordingError when no axis has an answer."""
    if any(result.estimate is not None for result in fit.axes.values()):
        return
    reasons = [
        found.reason
        for result in fit.axes.values()
        for found in (result.drag, result.inertia)
        if isinstance(found, Unusable)
    ]
    raise RecordingError("nothing can be identified: " + "; ".join(reasons))


def _replays(
    recordings: Sequence[Recording], lay_out: Installation, result: AxisResult, fit: VehicleFit
) -> tuple[Replay, ...]:
    """Steady recordings, then moving ones; none when inertia or drag is not known."""
    estimate = _simulated_by(result)
    if estimate is None:
        return ()
    steady = {one.recording_id for one in fit.trials[result.axis].steady}
    made = [trial(one, lay_out, result.axis, REPLAY_STEP) for one in recordings if one.recording_id in steady]
    ready = [*(one for one in made if isinstance(one, Trial)), *result.moving]
    return replay(ready, estimate, result.ballast) if ready else ()


def _simulated_by(result: AxisResult) -> Gaussian | None:
    """What a simulation needs: every parameter with a finite value, inertia among them."""
    estimate = result.estimate
    if estimate is None or "m" not in estimate.names or not np.all(np.isfinite(estimate.mean)):
        return None
    return estimate


def _held_out(
    kept: Sequence[Named], lay_out: Installation, facts: CampaignFacts, fit: VehicleFit, plain: VehicleFit | None
) -> tuple[HeldOut, ...]:
    """Each kept recording by the identified vehicle, and by `plain`, identified as if there were no interactions."""
    bare, out = replace(lay_out, interactions=()), []
    for axis, group in sort_trials([one.recording for one in kept], lay_out, facts).axes.items():
        for recording in (*group.steady, *group.moving):
            found = _one_replay(recording, lay_out, axis, facts, fit)
            if found is None:
                raise RecordingError(
                    f"{recording.source} drives {axis}, of which drag and inertia were not both identified; hold out "
                    "recordings of another axis, or give trials of this one"
                )
            without = _one_replay(recording, bare, axis, facts, plain) if plain is not None else None
            floats = _buoyancy(recording.recording_id, axis, facts, fit)
            note = "its ballast was not identified: buoyancy taken as the mean of the others" if floats.cov.size else ""
            out.append(HeldOut(recording.recording_id, axis, found, without, note))
    return tuple(out)


def _one_replay(
    recording: Recording, lay_out: Installation, axis: str, facts: CampaignFacts, fit: VehicleFit
) -> Replay | None:
    """A speed starts from its first measurement; a position where it suits the recording best."""
    result = fit.axes.get(axis)
    estimate = _simulated_by(result) if result is not None else None
    one = trial(recording, lay_out, axis)
    if estimate is None or isinstance(one, Unusable):
        return None
    name = recording.recording_id
    floats = ballast_of([name], facts.ballast) if axis == "heave" else {}
    whole = independent(estimate, _buoyancy(name, axis, facts, fit))
    return replay([one], whole, floats, fit_start=one.quantity != "speed")[0]


def _buoyancy(name: str, axis: str, facts: CampaignFacts, fit: VehicleFit) -> Gaussian:
    """For a recording whose ballast no other has: the mean of the buoyancies that were identified."""
    estimate = fit.axes[axis].estimate
    wanted = ballast_of([name], facts.ballast)[name]
    if axis != "heave" or estimate is None or wanted in estimate.names:
        return NOTHING
    others = [estimate[one] for one in estimate.names if one.startswith("buoyancy")]
    return Gaussian((wanted,), np.array([np.mean(others)]), np.zeros((1, 1)))


def _comparators(fit: VehicleFit) -> dict[str, tuple[InertiaFit | Unusable, ...]]:
    return {axis: rivals(result) for axis, result in fit.axes.items() if result.moving}
