"""What `rig diagnose` says to input that it cannot use: the sentence of each case, and exit status 2.

    python examples/diagnose_bad_input.py [FOLDER]

The files are made with plain h5py in FOLDER, by default one that goes away again.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import uuid
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np

RIG = (sys.executable, "-c", "from rig.cli import entry; entry()", "diagnose")


def recording(
    path: Path, thruster: str = "T1", seed: int = 1, change: Callable[[dict[str, Any]], None] | None = None
) -> Path:
    """Three minutes of levels up to +-20 V at 25 Hz, after the recording format, with one `change` to its columns."""
    rng = np.random.default_rng(seed)
    start = np.arange(0.0, 180.0, 3.0)
    level = rng.permutation(np.linspace(-20.0, 20.0, start.size))
    time = np.arange(0.0, 180.0, 0.04)
    volts = level[np.searchsorted(start, time, side="right") - 1]
    thrust = 0.4 * volts * np.abs(volts) + 0.3 + 0.2 * rng.standard_normal(time.size)
    columns = {"command": (start, level, "command_voltage", "V"), "cell": (time, thrust, "thrust", "N")}
    if change is not None:
        change(columns)
    with h5py.File(path, "w") as file:
        file.attrs.update(
            {
                "format": "thruster-rig-recording",
                "format_version": 1,
                "recording_id": str(uuid.uuid5(uuid.NAMESPACE_OID, f"{path.name} {seed}")),
                "thruster": thruster,
            }
        )
        for stream, (t, value, quantity, unit) in columns.items():
            file[f"streams/{stream}/time"] = t
            file[f"streams/{stream}/{quantity}"] = value
            file[f"streams/{stream}/{quantity}"].attrs.update({"quantity": quantity, "unit": unit})
    return path


def without_thrust(columns: dict[str, Any]) -> None:
    del columns["cell"]


def without_command(columns: dict[str, Any]) -> None:
    del columns["command"]


def constant(columns: dict[str, Any]) -> None:
    time, value, *rest = columns["command"]
    columns["command"] = (time, np.full(value.size, 6.0), *rest)


def twenty(columns: dict[str, Any]) -> None:
    time, value, *rest = columns["cell"]
    columns["cell"] = (time[:20], value[:20], *rest)


def all_nan(columns: dict[str, Any]) -> None:
    time, value, *rest = columns["cell"]
    columns["cell"] = (time, np.full(value.size, np.nan), *rest)


def nan_blocks(columns: dict[str, Any]) -> None:
    time, value, *rest = columns["cell"]
    columns["cell"] = (time, np.where((time % 15) < 5, np.nan, value), *rest)


def other_clock(columns: dict[str, Any]) -> None:
    time, *rest = columns["cell"]
    columns["cell"] = (time - 1.0e5, *rest)


def cases(folder: Path) -> dict[str, list[str]]:
    """Name of the case -> arguments of `rig diagnose`."""
    text = folder / "notes.h5"
    text.write_text("run 3, good weather\n")
    stranger = folder / "stranger.h5"
    with h5py.File(stranger, "w") as file:
        file["data"] = np.arange(3.0)
    good = recording(folder / "good.h5")
    twin = folder / "T2.twin.json"
    subprocess.run([*RIG, recording(folder / "T2.h5", "T2", 2), "--save-twin", twin], check=True, capture_output=True)
    broken = folder / "broken.twin.json"
    broken.write_text(twin.read_text().replace('"interval"', '"intervall"'))

    def changed(name: str, change: Callable[[dict[str, Any]], None]) -> list[str]:
        return [str(recording(folder / name, change=change))]

    return {
        "not there": [str(folder / "nowhere.h5")],
        "not HDF5": [str(text)],
        "HDF5 of another program": [str(stranger)],
        "no thrust channel": changed("no_thrust.h5", without_thrust),
        "no command": changed("no_command.h5", without_command),
        "constant command": changed("constant.h5", constant),
        "20 samples": changed("twenty.h5", twenty),
        "NaN throughout": changed("nan.h5", all_nan),
        "clocks that share no time": changed("clock.h5", other_clock),
        "two thrusters": [str(good), str(folder / "T2.h5")],
        "the same file twice": [str(good), str(good)],
        "hold-out of another thruster": [str(good), "--holdout", str(folder / "T2.h5")],
        "one file fitted and held out": [str(good), "--holdout", str(folder / "T2.h5"), str(good)],
        "a twin for a folder that is not there": [str(good), "--save-twin", str(folder / "absent" / "T1.json")],
        "a twin of another thruster": [str(good), "--twin", str(twin)],
        "a twin that is none": [str(good), "--twin", str(good)],
        "a twin with a key missing": [str(folder / "T2.h5"), "--twin", str(broken)],
        "NaN in blocks (can be used)": changed("nan_blocks.h5", nan_blocks),
    }


def said(arguments: Sequence[str]) -> tuple[int, str]:
    """Exit status and what was said."""
    done = subprocess.run([*RIG, *arguments], check=False, capture_output=True, text=True)
    return done.returncode, (done.stderr or done.stdout.split("\n\n")[0]).strip()


def main(folder: Path) -> None:
    for name, arguments in cases(folder).items():
        status, text = said(arguments)
        print(f"{name}: exit status {status}\n  {text.replace(str(folder) + '/', '')}")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as name:
            main(Path(name))
