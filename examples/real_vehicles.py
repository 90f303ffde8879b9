"""Identifies the vehicles that others have recorded: a surface vehicle on a lake, an underwater one holding its depth.

    python examples/real_vehicles.py [FOLDER]

FOLDER holds the recordings in `usv_lake` and `rov_depth`; default: `../shared/recordings` beside the project. They are
not part of the project: `origin` in `rig/importing/maps/*.toml` says who published them. What
is done here file by file is `rig import` and then `rig vehicle --installation examples/usv_lake.toml`.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from identification.vehicle.replay import Replay
from rig.importing.mapping import read_map
from rig.importing.one_file import import_file
from rig.vehicle.answer import VehicleAnswer, identify_files
from rig.vehicle.text import answer_text

EXAMPLES = Path(__file__).resolve().parent
HERE = EXAMPLES.parents[1] / "shared" / "recordings"
FOLDS = 3
"""Runs are held out a third at a time."""


def imported(paths: Sequence[Path], map_name: str, folder: Path) -> list[Path]:
    """Through `rig import`, as an operator would."""
    plan = read_map(map_name)
    return [import_file(path, plan, folder / f"{path.stem}.h5").path for path in paths]


def held_out(files: Sequence[Path], installation: Path) -> list[VehicleAnswer]:
    """Identified FOLDS times, each time without another third of the runs."""
    return [
        identify_files(
            [one for i, one in enumerate(files) if i % FOLDS != fold],
            installation=installation,
            holdout=[one for i, one in enumerate(files) if i % FOLDS == fold],
        )
        for fold in range(FOLDS)
    ]


def rms(found: Sequence[Replay]) -> str:
    """Over all runs; those in which the vehicle runs away are counted apart."""
    good = [one.validation.rmse for one in found if not one.ran_away]
    lost = len(found) - len(good)
    text = f"{np.sqrt(np.mean(np.square(good))):.4f}" if good else "-"
    return f"{text} ({lost} of {len(found)} runs not: there the identified vehicle runs away)" if lost else text


def show(files: Sequence[Path], installation: Path) -> None:
    """Identify from all files, then the error on runs that were not fitted."""
    print(answer_text(identify_files(files, installation=installation)), "\n")
    print("held out, a third of the runs at a time:")
    errors(files, installation)


def errors(files: Sequence[Path], installation: Path) -> None:
    """Simulation error on runs that were not fitted, with the efficiency and without."""
    folds = held_out(files, installation)
    kept = [one for answer in folds for one in answer.held_out]
    quantity = kept[0].replay.quantity
    print(f"  {quantity} off by {rms([one.replay for one in kept])} rms", end="")
    bare = [one.without for one in kept if one.without is not None]
    print(f" with the efficiency, {rms(bare)} without" if bare else "")
    for answer in folds:
        for result in answer.without.axes.values() if answer.without is not None else ():
            print("".join(f"  without it, {text}\n" for text in result.contradictions), end="")


def mass_held(installation: Path) -> Path:
    """The same installation with the mass exactly as stated: no model may buy a lower force with a heavier boat."""
    out = installation.with_name("mass_held.toml")
    out.write_text(installation.read_text(encoding="utf-8").replace("std = 2.8", "std = 0.01"), encoding="utf-8")
    return out


def main(root: Path) -> None:
    if not root.is_dir():
        print(f"{root} is not there; the real recordings are not part of the project")
        return
    with tempfile.TemporaryDirectory() as temporary:
        for name, pattern in (("usv_lake", "*_Run*.csv"), ("rov_depth", "*.csv")):
            folder = Path(temporary) / name
            folder.mkdir()
            files = imported(sorted((root / name).glob(pattern)), name, folder)
            if name == "usv_lake":
                imported([root / name / "tcurve.csv"], "usv_bollard", folder)
            shutil.copy(EXAMPLES / f"{name}.toml", folder)
            print(f"=== {name}")
            show(files, folder / f"{name}.toml")
            if name == "usv_lake":
                print("the same with the mass held at 28 kg:")
                errors(files, mass_held(folder / f"{name}.toml"))
            print()


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
