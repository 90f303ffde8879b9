"""What C V|V| leaves out of thrust recordings that others have made: fitted on one part, judged on another.

    python examples/real_diagnosis.py [FOLDER] [--whole] [--only NAME] [--reports FOLDER] [--json FILE]

FOLDER holds the recordings in the folders of CASES; default: `../shared/recordings` beside the project. They are not
part of the project: `origin` in `rig/importing/maps/*.toml` says who published them. What
is done here is `rig import` and then `rig diagnose FILES [--holdout FILE...]`. Printed are verdict, statement and the
error of what was not fitted: other runs where there are several, otherwise blocks of time (levels of a table).
`--whole` prints all that `rig diagnose` says; `--json` writes what `rig prove --beside` shows.
Boats and ROVs: `real_vehicle_diagnosis.py`.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time

import click

from identification.mismatch.diagnosis import Diagnosis
from rig.blind import beside
from rig.blind.beside import RealRecordings, real_case, unanswered
from rig.blind.store import version_of_diagnosis
from rig.diagnose.command import diagnose_files
from rig.diagnose.recording_names import file_names, told_by_name
from rig.diagnose.report.page import write
from rig.diagnose.text import diagnosis_text
from rig.importing.mapping import read_map
from rig.importing.one_file import import_file

HERE = Path(__file__).resolve().parents[2] / "shared" / "recordings"


@dataclass(frozen=True)
class Case:
    """Files of one folder, read by one shipped map: those that are fitted, and those that judge."""

    name: str
    folder: str
    map: str
    fitted: str
    judged: str = ""
    parameters: tuple[tuple[str, float], ...] = ()
    thruster: str = ""
    """Where the files do not say which it was, and their names differ."""


CASES = (
    Case("tank static", "rov_thruster_tank", "tank_static_levels", "Tach_RPM_Thrust_Data.csv"),
    Case("tank forward-reverse", "rov_thruster_tank", "tank_six_axis", "Fwd_Rvrs_Set[13].csv", "Fwd_Rvrs_Set2.csv"),
    Case("tank +2 V", "rov_thruster_tank", "tank_two_state", "2statep2V.csv"),
    Case("tank -2 V", "rov_thruster_tank", "tank_two_state", "2statem2V.csv", parameters=(("direction", -1.0),)),
    Case(
        "stand, voltage sine",
        "voltage_sine_stand",
        "labview_voltage_sine",
        "*test[25].log",
        "*test6.log",
        thruster="the stand's",
    ),
    Case("supply sag", "propeller_supply_sag", "crazyflie_supply_sag", "cf21_stock2.csv", "cf2.1-stock-prop.csv"),
    Case("M5 static", "m5_static", "effort_static", "json_nez_prop.csv"),
    Case("M5 static, other propeller", "m5_static", "effort_static", "video_ray_prop_calibration.csv"),
    Case("T200 at 18 V", "t200_18v_static", "blue_robotics_static", "*.csv"),
)


def imported(root: Path, case: Case, pattern: str, folder: Path) -> list[Path]:
    """The recordings of that pattern, made in `folder`."""
    plan = read_map(case.map)
    plan = replace(plan, thruster=case.thruster or plan.thruster)
    files = sorted((root / case.folder).glob(pattern)) if pattern else []
    return [import_file(p, plan, folder / f"{p.stem}.h5", dict(case.parameters)).path for p in files]


def diagnosed(root: Path, case: Case, folder: Path) -> Diagnosis:
    """Imported into `folder` and diagnosed."""
    fitted, judged = (imported(root, case, pattern, folder) for pattern in (case.fitted, case.judged))
    return told_by_name(diagnose_files(fitted, judged), file_names([*fitted, *judged]))


def short(case: Case, found: Diagnosis, took: float) -> str:
    held = found.heldout
    error = f"{held.before:.4g} -> {held.after:.4g} N rms with all that the model has (noise {held.noise:.3g})"
    return f"{case.name}: {found.headline}\n  {found.statement}\n  not fitted: {error}; {held.what}; {took:.0f} s"


@click.command(help=__doc__)
@click.argument("root", metavar="FOLDER", type=click.Path(path_type=Path), default=HERE)
@click.option("--whole", is_flag=True)
@click.option("--only", default="")
@click.option("--reports", type=click.Path(path_type=Path))
@click.option("--json", "json_path", type=click.Path(path_type=Path))
def main(root: Path, whole: bool, only: str, reports: Path | None, json_path: Path | None) -> None:
    if not root.is_dir():
        print(f"{root} is not there; the real recordings are not part of the project")
        return
    told = []
    for case in CASES:
        if only not in case.name:
            continue
        begun = process_time()
        with tempfile.TemporaryDirectory() as temporary:
            try:
                found = diagnosed(root, case, Path(temporary))
            except Exception as error:  # noqa: BLE001  # a crash is an answer too, and does not end the others
                told.append(unanswered(case.name, error))
                print(f"{case.name}: {told[-1].verdict}\n  {told[-1].statement}\n", flush=True)
                continue
        told.append(real_case(case.name, found))
        print(diagnosis_text(found) if whole else short(case, found, process_time() - begun), end="\n\n", flush=True)
        if reports is not None:
            reports.mkdir(parents=True, exist_ok=True)
            write(found, reports / f"{case.name.replace(' ', '_')}.html")
    if json_path is not None:
        beside.write(json_path, RealRecordings(version_of_diagnosis(), tuple(told)))


if __name__ == "__main__":
    main()
