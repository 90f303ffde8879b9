"""What `rig diagnose` is told of a vehicle: its thrusters and lay-out as `rig vehicle` takes them, and its mass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import ConfigError, RecordingError

if TYPE_CHECKING:
    from identification.mismatch.diagnosis import Diagnosis
    from identification.mismatch.vehicle.setup import Stated, VehicleSetup
    from identification.recording import Recording
    from rig.vehicle.installation import InstallationFile
    from rig.vehicle.thrusters import Calibration


@dataclass(frozen=True, slots=True)
class VehicleFiles:
    """Options of the command line that speak of a vehicle."""

    thrusters: tuple[Path, ...] = ()
    """What `rig fit --json` wrote."""
    installation: Path | None = None
    """Which thruster sits where, and what each trial was (TOML)."""
    mass: float | None = None
    """kg (yaw: kg.m^2) of the axis diagnosed, in the place of what the installation file says."""
    mass_std: float = 0.0
    axis: str = ""
    """surge, sway, heave or yaw: only the recordings that drive it are diagnosed."""

    @property
    def given(self) -> bool:
        return bool(self.thrusters or self.axis) or self.installation is not None or self.mass is not None


def is_vehicle(recordings: Sequence[Recording]) -> bool:
    """Whether any of the recordings is of a vehicle."""
    return any(recording.kind == "vehicle" for recording in recordings)


def refuse_for_tunnel(files: VehicleFiles) -> None:
    """Raises ConfigError when options of a vehicle come with recordings of a thruster."""
    if files.given:
        raise ConfigError(
            "--thrusters, --installation, --mass and --axis speak of a vehicle; these are recordings of a thruster"
        )


def diagnose_vehicle_files(
    recordings: Mapping[Path, Recording], holdout: Mapping[Path, Recording], seed: int, files: VehicleFiles
) -> Diagnosis:
    """Raises RecordingError for what cannot be diagnosed, ConfigError for an option that cannot be used."""
    from identification.mismatch.prepare.preparing import Refusal
    from identification.mismatch.vehicle.diagnose import diagnose_vehicle

    _check(files)
    everything = {**recordings, **holdout}
    setup = setup_of(files, everything)
    kept = _on_axis(recordings, setup, everything)
    back = _on_axis(holdout, setup, everything)
    found = diagnose_vehicle(kept, back, seed, setup)
    if isinstance(found, Refusal):
        raise RecordingError(found.reason)
    return found


def _check(files: VehicleFiles) -> None:
    if files.mass is not None and not (isfinite(files.mass) and files.mass > 0):
        raise ConfigError(f"--mass {files.mass:g}: expected a number of kg above 0")
    if not (isfinite(files.mass_std) and files.mass_std >= 0):
        raise ConfigError(f"--mass-std {files.mass_std:g}: expected a number of kg, 0 or above")
    if files.mass_std and files.mass is None:
        raise ConfigError("--mass-std needs --mass")


def setup_of(files: VehicleFiles, recordings: Mapping[Path, Recording]) -> VehicleSetup:
    """Raises ConfigError with one sentence."""
    from identification.mismatch.vehicle.setup import ANY_AXIS, Stated, VehicleSetup
    from rig.vehicle.recordings import matched, name_of
    from rig.vehicle.thrusters import installed, read_fits

    fits = read_fits(files.thrusters)
    mass = {} if files.mass is None else {ANY_AXIS: Stated(files.mass, files.mass_std)}
    file = _file(files, fits, recordings)
    ids: dict[str, str] = {}
    for path, recording in recordings.items():
        ids[name_of(path, ids)] = recording.recording_id
    if file is None:
        return VehicleSetup(mass=mass, axis=files.axis, ballast={one: name for name, one in ids.items()})
    said = matched(ids, file.trials)
    return VehicleSetup(
        installation=installed(file, fits),
        mass={**_masses(file), **mass},
        ballast={one: said[name].ballast if name in said and said[name].ballast else name for name, one in ids.items()},
        axis=files.axis,
        axes={ids[name]: one.axis for name, one in said.items() if one.axis},
        current=file.vehicle.current,
    )


def _file(
    files: VehicleFiles, fits: Mapping[str, Calibration], recordings: Mapping[Path, Recording]
) -> InstallationFile | None:
    """The installation file; without one, thrusters that push straight ahead; None: of unknown strength too."""
    from rig.vehicle.installation import InstallationFile, Vehicle, load_installation
    from rig.vehicle.thrusters import straight_ahead

    if files.installation is not None:
        return load_installation(files.installation)
    if not fits:
        return None
    mounted = straight_ahead(recordings.values())
    if not mounted:
        raise ConfigError(
            "--installation was not given, and the recordings do not tell along which axis each thruster pushes; "
            "docs/howto/vehicle.md shows an installation file"
        )
    return InstallationFile(Path("(no --installation)"), "", Vehicle(), mounted)


def _masses(file: InstallationFile) -> dict[str, Stated]:
    from identification.mismatch.vehicle.setup import Stated

    return {axis: Stated(told["m"].value, told["m"].std) for axis, told in file.known.items() if "m" in told}


def _on_axis(
    recordings: Mapping[Path, Recording], setup: VehicleSetup, everything: Mapping[Path, Recording]
) -> list[Recording]:
    """With --axis, those that drive it; otherwise all of them."""
    from identification.mismatch.prepare.preparing import Refusal
    from identification.mismatch.vehicle.setup import driven_axis, straight_ahead

    if not setup.axis or not recordings:
        return list(recordings.values())
    installation = setup.installation or straight_ahead(list(everything.values()))
    if isinstance(installation, Refusal):
        raise RecordingError(installation.reason)
    kept = [r for r in recordings.values() if driven_axis(r, installation, setup) == setup.axis]
    if not kept:
        raise RecordingError(f"none of the recordings drives {setup.axis}")
    return kept
