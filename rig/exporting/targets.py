"""What may be exported as what: the kind of the file decides what there is to choose from. One table, which grows."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Final, NamedTuple

from rig.errors import ConfigError, RecordingError

RECORDING: Final = "recording"
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


TARGETS: Final = {
    "csv": Target(RECORDING, "rig.exporting.csv_folder:write", "-csv"),
    "parquet": Target(RECORDING, "rig.exporting.parquet_folder:write", "-parquet", "pyarrow"),
    "mat": Target(RECORDING, "rig.exporting.mat_file:write", ".mat"),
    "mcap": Target(RECORDING, "rig.exporting.mcap_file:write", ".mcap", "mcap"),
}


def kind_of(path: Path) -> str:
    """What a file is by what is in it. Raises RecordingError for one that is nothing the rig makes."""
    from rig.hdf5 import is_hdf5  # h5py only where a file is looked at

    if is_hdf5(path):
        return RECORDING
    if not path.is_file():
        raise RecordingError(f"{path} is no file; give the path of a recording (*.h5)")
    try:
        content = json.loads(path.read_bytes()) if path.stat().st_size <= MOST_BYTES else None
    except (OSError, ValueError, RecursionError):
        content = None
    found = str(content.get("format")) if isinstance(content, dict) else ""
    if not found.startswith(PREFIX):
        raise RecordingError(f"{path} is nothing that the rig makes; `rig export` takes a recording (*.h5)")
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
