"""What may be exported as what: the kind of the file decides what there is to choose from. One table, which grows."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Final, NamedTuple

from rig.errors import ConfigError, RecordingError

RECORDING: Final = "recording"
TWIN: Final = "twin"
PREFIX: Final = "thruster-rig-"
"""Of the `format` of every JSON file that the rig writes; its kind follows."""
MOST_BYTES: Final = 2**26
"""Of a JSON file that is looked into; a twin has some 50 kB."""


class Target(NamedTuple):
    """One word after `--to`."""

    of: str
    """Kind of the file that is exported."""
    writer: str
    """`module:function`, called with content and path; imported when it is used."""
    ending: str
    """Of the file or folder it makes, behind the stem of the recording."""
    needs: str = ""
    """A package that is not there unless the extra of the same name as the target was asked for."""
    carried: str = ""
    """Of a twin, `module:function` that tells what its consumer makes of the file."""


def _twin(module: str, ending: str, write: str = "write", carried: str = "carried") -> Target:
    place = f"rig.exporting.twins.{module}"
    return Target(TWIN, f"{place}:{write}", ending, carried=f"{place}:{carried}")


TARGETS: Final = {
    "csv": Target(RECORDING, "rig.exporting.csv_folder:write", "-csv"),
    "parquet": Target(RECORDING, "rig.exporting.parquet_folder:write", "-parquet", "pyarrow"),
    "mat": Target(RECORDING, "rig.exporting.mat_file:write", ".mat"),
    "mcap": Target(RECORDING, "rig.exporting.mcap_file:write", ".mcap", "mcap"),
    "table": _twin("tables", "-thrust.csv", "write_csv"),
    "c-header": _twin("tables", "_thrust.h", "write_header", "header_carried"),
    "stonefish": _twin("stonefish", "-stonefish.xml"),
    "uuv": _twin("uuv", "-uuv.xml"),
    "uuv-manager": _twin("uuv", "-uuv-manager.yaml", "write_manager", "manager_carried"),
    "plankton-manager": _twin("uuv", "-plankton-manager.yaml", "write_plankton", "manager_carried"),
    "gz-sim": _twin("gz_sim", "-gz-sim.sdf", "write", "in_newtons"),
    "gz-sim-rate": _twin("gz_sim", "-gz-sim-rate.sdf", "write_by_rate", "by_rate"),
    "auv-polynomial": _twin("auv_controllers", "-auv-controllers.yaml"),
    "ardusub": _twin("autopilots", "-ardusub.param", "write_ardusub", "ardusub_carried"),
    "px4": _twin("autopilots", "-px4.params", "write_px4", "px4_carried"),
    "mss": _twin("fossen", "_mss.m", "write_mss"),
    "pvs": _twin("fossen", "_pvs.py", "write_pvs"),
    "holoocean": _twin("holoocean", "_holoocean.py"),
    "fmu": _twin("fmu", ".fmu"),
}


def kind_of(path: Path) -> str:
    """What a file is by what is in it. Raises RecordingError for one that is nothing the rig makes."""
    from rig.hdf5 import is_hdf5  # h5py only where a file is looked at

    if is_hdf5(path):
        return RECORDING
    if not path.is_file():
        raise RecordingError(f"{path} is no file; give the path of a recording (*.h5) or of a twin")
    try:
        content = json.loads(path.read_bytes()) if path.stat().st_size <= MOST_BYTES else None
    except (OSError, ValueError, RecursionError):
        content = None
    found = str(content.get("format")) if isinstance(content, dict) else ""
    if not found.startswith(PREFIX):
        raise RecordingError(
            f"{path} is nothing that the rig makes; `rig export` takes a recording (*.h5) or a twin (rig diagnose"
            " --save-twin)"
        )
    return found.removeprefix(PREFIX)


def target_of(path: Path, word: str) -> Target:
    """Raises RigError for a file that is of another kind, and for a package that is not installed."""
    target, kind = TARGETS[word], kind_of(path)
    if target.of != kind:
        fitting = [name for name, other in TARGETS.items() if other.of == kind]
        hint = f"a {kind} goes to {', '.join(fitting)}" if fitting else f"a {kind} can't be exported"
        raise ConfigError(f"--to {word}: this takes a {target.of}, but {path} is a {kind}; {hint}")
    if target.needs and find_spec(target.needs) is None:
        raise ConfigError(
            f"--to {word} needs {target.needs}, which is not installed: pip install 'thruster-rig[{word}]'"
        )
    return target
