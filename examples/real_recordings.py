"""Imports and fits every recording others have shared with us, and prints the known figures beside ours.

    python examples/real_recordings.py [FOLDER]

FOLDER holds the recordings in the folders of SOURCES; default: `../shared/recordings` beside the project. They are not
part of the project: `origin` in `rig/importing/maps/*.toml` says who published them.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identification.estimation.least_squares import Method
from identification.recording import Recording
from identification.steady_state.points import voltage_channel
from identification.thruster.thrust_data import voltage_at
from identification.thruster.thrust_forms import Model
from rig.errors import RecordingError
from rig.fit.command import answer_text, fit_recordings
from rig.hdf5 import load
from rig.importing.mapping import read_map
from rig.importing.one_file import import_file

HERE = Path(__file__).resolve().parents[1].parent / "shared" / "recordings"


@dataclass(frozen=True)
class Source:
    """Files of one folder that one shipped map reads. `known`: what was found by hand, from that folder's README."""

    folder: str
    pattern: str
    map: str
    known: str = "none"
    together: bool = False
    against: str = "command_voltage"
    parameters: tuple[tuple[str, float], ...] = ()


SOURCES = (
    Source(
        "rov_thruster_tank",
        "Tach_RPM_Thrust_Data.csv",
        "tank_static_levels",
        "C V|V| 4.3 N, C+/C- 4.3 N, fitted on these levels and judged on another campaign (not in the folder)",
    ),
    Source(
        "rov_thruster_tank",
        "Tach_RPM_Thrust_Data.csv",
        "tank_static_levels",
        "none by rate; order matters: with n measured the dead band is gone and C+/C- shows",
        against="rotation_rate",
    ),
    Source("rov_thruster_tank", "Fwd_Rvrs_Set*.csv", "tank_six_axis", "C n|n| 2.0 N, C+/C- 1.7 N", together=True),
    Source("rov_thruster_tank", "2statep2V.csv", "tank_two_state"),
    Source("rov_thruster_tank", "2statem2V.csv", "tank_two_state", parameters=(("direction", -1.0),)),
    Source("voltage_sine_stand", "*.log", "labview_voltage_sine", "no tare 58.7 N, with it 5.3 N, C+/C- 3.1 N"),
    Source(
        "propeller_supply_sag",
        "*.csv",
        "crazyflie_supply_sag",
        "C V|V| 0.036 N (descending half, fitted on the ascending one)",
    ),
    Source("m5_static", "*.csv", "effort_static", "exponent well below 2"),
    Source("t200_18v_static", "*.csv", "blue_robotics_static", "C+/C- needed, after back-EMF and winding resistance"),
    Source("usv_lake", "tcurve.csv", "usv_bollard"),
    Source("usv_lake", "14FEB*.csv", "usv_lake", "no thrust measured: efficiency near 0.4"),
    Source("rov_depth", "*.csv", "rov_depth", "no thrust measured"),
)


def read(source: Source, folder: Path, out: Path) -> list[Recording]:
    """Import the files into `out` and load them, in order of name."""
    found = []
    plan = read_map(source.map)
    for path in sorted((folder / source.folder).glob(source.pattern)):
        target = out / f"{source.folder}-{path.stem}-{source.map}-{source.against}.h5"
        import_file(path, plan, target, dict(source.parameters))
        found.append(load(target))
    return found


def show(recordings: list[Recording], source: Source, model: Model = "C V|V|", method: Method = "wls") -> None:
    """Print the fit, or the sentence that says why there is none."""
    try:
        for answer in fit_recordings(recordings, model, source.against, method):
            print(answer_text(answer))
    except RecordingError as error:
        print(f"  no fit: {error}")
        if any(recording.kind == "vehicle" for recording in recordings):
            print("  (its drag and inertia are another command's work: this one asks for a measured force)")
    print()


def no_tare(recordings: list[Recording]) -> None:
    """C V|V| alone, by plain least squares: of all samples, and of the second half when fitted on the first."""
    for recording in recordings:
        thrust, voltage = recording.first_of("thrust"), voltage_channel(recording)
        assert thrust is not None
        assert voltage is not None
        V = voltage_at(voltage, thrust.time)
        good = np.isfinite(thrust.value) & np.isfinite(V)
        square, F = (V * np.abs(V))[good], thrust.value[good]
        half = F.size // 2
        errors = [F - square * (square[:n] @ F[:n]) / (square[:n] @ square[:n]) for n in (F.size, half)]
        whole, late = (np.sqrt(np.mean(left**2)) for left in (errors[0], errors[1][half:]))
        print(f"  {recording.source}: without a tare RMSE {whole:.3g} N; second half from the first {late:.3g} N")


def plateaus(folder: Path, static: list[Recording], out: Path) -> None:
    """The 21 levels judged on the +-2 V holds of other runs: thrust of the hold, less that at rest."""
    answer = fit_recordings(static)[0].fit
    C, wrong = answer.parameters["C"].value, []
    for source in SOURCES:
        if source.map != "tank_two_state":
            continue
        for recording in read(source, folder, out):
            thrust = recording.first_of("thrust")
            assert thrust is not None
            rest = float(thrust.value[:1000].mean())
            volts = 2.0 * dict(source.parameters).get("direction", 1.0)
            middle = thrust.window(9.0, 11.0)[1]
            held = float(middle.mean()) - rest
            wrong.append(C * volts * abs(volts) - held)
            print(f"  {recording.source}: {held:+.2f} N at {volts:+g} V, C V|V| says {C * volts * abs(volts):+.2f}")
    if wrong:
        print(f"  RMSE of the 21-level fit on these holds: {np.sqrt(np.mean(np.square(wrong))):.2f} N (known 4.3 N)")


def main(folder: Path) -> None:
    if not folder.is_dir():
        print(f"{folder} is not here: the real recordings are not part of the project; give their folder as argument")
        return
    with tempfile.TemporaryDirectory() as temporary:
        out = Path(temporary)
        for k, source in enumerate(SOURCES):
            place = out / str(k)
            place.mkdir()
            recordings = read(source, folder, place)
            print(f"=== {source.folder}/{source.pattern}: {len(recordings)} file(s); known: {source.known}")
            if source.folder in {"voltage_sine_stand", "propeller_supply_sag"}:
                no_tare(recordings)
            for part in [recordings] if source.together else [[r] for r in recordings]:
                show(part, source)
            if k == 0:
                plateaus(folder, recordings, place)
            if source.folder == "propeller_supply_sag":
                print(
                    "--- the last file by plain least squares (LS): no standard errors used, hence no chi-square test"
                )
                show(recordings[-1:], source, "C V|V|", "ls")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
