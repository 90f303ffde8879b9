"""Identifies the vehicles that others have recorded: a surface vehicle on a lake, an underwater one holding its depth.

    python examples/real_vehicles.py [FOLDER]

FOLDER holds the recordings; default: `../shared/recordings` beside the project. They are not part of the project.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from identification.efficiency import Installation, Interaction, Thruster
from identification.inertia import InertiaFit, output_error
from identification.maximum_likelihood import Gaussian, independent
from identification.recording import Floats, Recording
from identification.thrust_data import Unusable
from identification.vehicle_simulation import Validation, validate
from identification.vehicle_trials import Trial, trial
from rig.hdf5 import load
from rig.importer import import_file
from rig.importing.mapping import read_map

HERE = Path(__file__).resolve().parents[1].parent / "shared" / "recordings"
MASS = Gaussian(("m",), np.array([28.0]), np.array([[2.8**2]]))
"""kg: what the maker states of the empty vehicle (bsb808/pub_usv_modeling, usv_modeling.tex, not weighed there; added
mass ignored). 10 % stands for both: an assumption, and everything in newtons scales with it."""
FIXED = Gaussian(("m",), np.array([28.0]), np.array([[1e-4]]))
DRIFT = Gaussian(("current_north", "current_east"), np.zeros(2), 0.3**2 * np.eye(2))
"""m/s: a current or wind drift; the speed is over ground and does not go to zero when the thrust does."""
FOLDS = 3


def imported(path: Path, map_name: str) -> Recording:
    """Through `rig import`, as an operator would."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "one.h5"
        import_file(path, read_map(map_name), out)
        return load(out)


def bollard_curve(path: Path) -> tuple[Floats, Floats]:
    """Levels, ascending, and newtons."""
    recording = imported(path, "usv_bollard")
    command, force = recording.first_of("command_voltage"), recording.first_of("thrust")
    assert command is not None
    assert force is not None
    levels = command.held_at(force.time)
    order = np.argsort(levels)
    return levels[order], force.value[order]


def boat(levels: Floats, newtons: Floats, *, efficiency: bool) -> Installation:
    """Two thrusters, each with the bollard curve; its authors call the table that of a single thruster."""
    sides = tuple(Thruster(name, newtons, {"surge": 1.0}, levels) for name in ("port", "starboard"))
    eta = (Interaction("eta", ("port", "starboard")),) if efficiency else ()
    return Installation(sides, np.zeros((2 * levels.size, 2 * levels.size)), eta)


def fitted(trials: Sequence[Trial], known: Gaussian, free: Mapping[str, float]) -> InertiaFit:
    found = output_error(trials, known, free)
    if isinstance(found, Unusable):
        raise SystemExit(found.reason)
    return found


def of_axis(recordings: Sequence[Recording], installation: Installation, axis: str) -> list[Trial]:
    made = [trial(recording, installation, axis) for recording in recordings]
    return [one for one in made if isinstance(one, Trial)]


def rms(found: Sequence[Validation]) -> float:
    return float(np.sqrt(np.mean([v.rmse**2 for v in found])))


def held_out(trials: Sequence[Trial], known: Gaussian, free: Mapping[str, float]) -> float:
    """Root mean square of the simulation error on trials that were not fitted, by leaving out a third at a time."""
    found: list[Validation] = []
    for fold in range(FOLDS):
        rest = [one for i, one in enumerate(trials) if i % FOLDS != fold]
        kept = [one for i, one in enumerate(trials) if i % FOLDS == fold]
        model = fitted(rest, known, free)
        found.extend(validate(kept, model.estimate, fit_start=False))
    return rms(found)


def lake(folder: Path) -> None:
    levels, newtons = bollard_curve(folder / "tcurve.csv")
    recordings = [imported(path, "usv_lake") for path in sorted(folder.glob("*_Run*.csv"))]
    print(f"surface vehicle: {len(recordings)} runs, bollard curve of {levels.size} levels")
    cases = (
        ("bollard thrust as it is, mass as stated", False, independent(FIXED, DRIFT)),
        ("bollard thrust as it is, mass free", False, independent(DRIFT)),
        ("installation efficiency, mass as stated", True, independent(MASS, DRIFT)),
    )
    for name, efficiency, known in cases:
        trials = of_axis(recordings, boat(levels, newtons, efficiency=efficiency), "surge")
        start = {"m": 28.0, "k": 5.0, "k2": 10.0} | ({"eta": 0.5} if efficiency else {})
        found = fitted(trials, known, start)
        print(f"  {name}:")
        for sentence in found.statements:
            print(f"    {sentence}")
        print(f"    held out: speed {held_out(trials, known, start):.4f} m/s rms in runs that were not fitted")


def depth(folder: Path) -> None:
    recordings = [imported(path, "rov_depth") for path in sorted(folder.glob("*.csv"))]
    print(f"underwater vehicle, closed-loop depth: {len(recordings)} runs; the thrust is not known")
    heave = Thruster("heave", np.array([-1.0]), {"heave": 1.0}, None)
    linear = Thruster("heave", np.array([1.0, -1.0]), {"heave": 1.0}, np.array([-1.0, 1.0]))
    for name, thruster in (("thrust as command squared", heave), ("thrust as command", linear)):
        scaled = Installation((thruster,), np.zeros((len(thruster.names),) * 2), (Interaction("push", ("heave",)),))
        trials = of_axis(recordings, scaled, "heave")
        floats = {one.recording_id: f"buoyancy[{i + 1}]" for i, one in enumerate(trials)}
        known = Gaussian(("m",), np.array([1.0]), np.array([[1e-12]]))
        start = {"m": 1.0, "k": 1.0, "k2": 1.0, "push": 1.0, **dict.fromkeys(floats.values(), 0.0)}
        found = output_error(trials, known, start, floats)
        if isinstance(found, Unusable):
            print(found.reason)
            continue
        print(f"  {name}; everything per kg of inertia:")
        for sentence in found.statements:
            print(f"    {sentence}")


def main(root: Path) -> None:
    if not root.is_dir():
        print(f"{root} is not there; the real recordings are not part of the project")
        return
    lake(root / "usv_lake")
    depth(root / "rov_depth")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
