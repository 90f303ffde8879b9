"""What the model of a vehicle leaves out of recordings that others have made: a boat on a lake, an ROV in a tank.

    python examples/real_vehicle_diagnosis.py [FOLDER] [--whole] [--json FILE]

FOLDER holds the recordings in `usv_lake` and `rov_depth`; default: `../shared/recordings` beside the project. They are
not part of the project: `origin` in `rig/importing/maps/*.toml` says who published them. What
is done here is `rig import` and then `rig diagnose FILES --installation examples/usv_lake.toml`. Printed are verdict,
statement and the error of runs that were not fitted; `--whole` prints all that `rig diagnose` says; `--json` writes
what `rig prove --beside` shows.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import click

from identification.mismatch.diagnosis import Diagnosis
from rig.blind import beside
from rig.blind.beside import RealRecordings, real_case, unanswered
from rig.blind.store import version_of_diagnosis
from rig.diagnose.command import diagnose_files
from rig.diagnose.text import diagnosis_text
from rig.diagnose.vehicle import VehicleFiles
from rig.importing.mapping import read_map
from rig.importing.one_file import import_file

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


@click.command(help=__doc__)
@click.argument("root", metavar="FOLDER", type=click.Path(path_type=Path), default=HERE)
@click.option("--whole", is_flag=True)
@click.option("--json", "json_path", type=click.Path(path_type=Path))
def main(root: Path, whole: bool, json_path: Path | None) -> None:
    if not root.is_dir():
        print(f"{root} is not there; the real recordings are not part of the project")
        return
    told = []
    for name, pattern, curve in VEHICLES:
        with tempfile.TemporaryDirectory() as temporary:
            try:
                found = diagnosed(root, name, pattern, curve, Path(temporary))
            except Exception as error:  # noqa: BLE001  # a crash is an answer too, and does not end the others
                told.append(unanswered(name, error))
                print(f"{name}: {told[-1].verdict}\n  {told[-1].statement}\n", flush=True)
                continue
        print(diagnosis_text(found) if whole else short(name, found), end="\n\n", flush=True)
        told.append(real_case(name, found))
    if json_path is not None:
        beside.write(json_path, RealRecordings(version_of_diagnosis(), tuple(told)))


if __name__ == "__main__":
    main()
