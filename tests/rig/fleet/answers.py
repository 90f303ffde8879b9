"""Functions that a question may name: each leaves a line of who was asked; one of them ends its process."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rig.errors import RecordingError
from rig.hdf5.apart import apart

COLUMNS_OF = {"created": "2026-11-26T10:00:00+00:00"}


def asked(path: Path, options: Mapping[str, Any]) -> int:
    """How many times this file was asked, this time with it."""
    with Path(options["log"]).open("a+", encoding="utf-8") as log:
        log.write(f"{path.name}\n")
        log.seek(0)
        return log.read().split().count(path.name)


def plain(path: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    asked(path, options)
    sys.stdout.write("what a library prints is no row\n")
    return {**COLUMNS_OF, "thruster": f"T-{path.stem}"}


def dies(path: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """Its process is killed at these files, as often as `times`."""
    if asked(path, options) <= options["times"] and path.name in options["at"]:
        os.kill(os.getpid(), signal.SIGKILL)
    return dict(COLUMNS_OF)


def reader_dies(path: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    """The child that reads these files is killed, as often as `times`."""
    killed = asked(path, options) <= options["times"] and path.name in options["at"]
    return apart(lambda: os.kill(os.getpid(), signal.SIGKILL) if killed else dict(COLUMNS_OF), path)


def waits(path: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    asked(path, options)
    if path.name in options["at"]:
        time.sleep(600.0)
    return dict(COLUMNS_OF)


def refuses(path: Path, options: Mapping[str, Any]) -> dict[str, Any]:
    asked(path, options)
    raise RecordingError(f"{path} is of no use") if path.stem == "a" else ZeroDivisionError("of no number")
