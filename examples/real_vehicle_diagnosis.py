"""What the model of a vehicle leaves out of recordings that others have made: a boat on a lake, an ROV in a tank.

    python examples/real_vehicle_diagnosis.py [FOLDER] [--whole]

FOLDER holds the recordings, a folder for each table; default: `../shared/recordings` beside the project. They are not
part of the project: `origin` in `rig/maps/*.toml` says who published them. What
is done here is `rig import` and then `rig diagnose FILES --installation examples/usv_lake.toml`. Printed are verdict,
statement and the error of runs that were not fitted; `--whole` prints all that `rig diagnose` says.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

from identification.mismatch.diagnosis import Diagnosis
from rig.diagnose import diagnose_files
from rig.diagnose_text import diagnosis_text
from rig.diagnose_vehicle import VehicleFiles
from rig.importer import import_file
from rig.importing.mapping import read_map

EXAMPLES = Path(__file__).resolve().parent
HERE = EXAMPLES.parents[1] / "shared" / "recordings"
VEHICLES = (("usv_lake", "*_Run*.csv", "tcurve.csv"), ("rov_depth", "*.csv", ""))
"""Folder and map, recordings, bollard curve."""


def diagnosed(root: Path, name: str, pattern: str, curve: str, folder: Path) -> Diagnosis:
    """Imported into `folder` and diagnosed with the installation file of that name."""
    plan = read_map(name)
    files = [import_file(path, plan, folder / f"{path.stem}.h5").path for path in sorted((root / name).glob(pattern))]
    if curve:
        import_file(root / name / curve, read_map("usv_bollard"), folder / f"{Path(curve).stem}.h5")
    installation = folder / f"{name}.toml"
    shutil.copy(EXAMPLES / installation.name, installation)
    return diagnose_files(files, vehicle=VehicleFiles(installation=installation))


def short(name: str, found: Diagnosis) -> str:
    held = found.heldout
    error = f"{held.before:.4g} -> {held.after:.4g} {found.unit} rms of {found.response} (noise {held.noise:.3g})"
    return f"{name}: {found.verdict}\n  {found.statement}\n  not fitted: {error}; {held.what}"


def main(root: Path, *, whole: bool) -> None:
    if not root.is_dir():
        print(f"{root} is not there; the real recordings are not part of the project")
        return
    for name, pattern, curve in VEHICLES:
        with tempfile.TemporaryDirectory() as temporary:
            found = diagnosed(root, name, pattern, curve, Path(temporary))
            print(diagnosis_text(found) if whole else short(name, found), flush=True)
            print()


if __name__ == "__main__":
    folders = [Path(text) for text in sys.argv[1:] if not text.startswith("--")]
    main(folders[0] if folders else HERE, whole="--whole" in sys.argv)
