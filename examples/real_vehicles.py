"""Identifies the vehicles that others have recorded: a surface vehicle on a lake, an underwater one holding its depth.

    python examples/real_vehicles.py [FOLDER]

FOLDER holds the recordings; default: `../shared/recordings` beside the project. They are not part of the project. What
is done here file by file is `rig import` and then `rig vehicle --installation examples/usv_lake.toml`.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rig.importer import import_file
from rig.importing.mapping import read_map
from rig.vehicle import VehicleAnswer, identify_files
from rig.vehicle_text import answer_text

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


def rms(errors: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def show(files: Sequence[Path], installation: Path) -> None:
    """Identify from all files, then the error on runs that were not fitted, with the efficiency and without."""
    print(answer_text(identify_files(files, installation=installation)))
    kept = [one for answer in held_out(files, installation) for one in answer.held_out]
    quantity = kept[0].replay.quantity
    found = f"{rms([one.replay.validation.rmse for one in kept]):.4f}"
    bare = [one.without.validation.rmse for one in kept if one.without is not None]
    print(f"\nheld out, a third of the runs at a time: {quantity} off by {found} rms with the efficiency", end="")
    print(f", {rms(bare):.4f} without" if bare else "")


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
            print()


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
