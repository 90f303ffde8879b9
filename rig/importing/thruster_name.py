"""Whose run an imported recording is: said, by the map, or by the file's name; else it is asked for."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from rig.errors import ConfigError
from rig.importing.mapping import ImportMap

NAMED: Final = re.compile(
    r"(?:^|[^A-Za-z0-9])(T\d{1,3}|M\d{1,2}|t(?:100|200|500)|(?i:thruster[-_ ]?\d+))(?=$|[^A-Za-z0-9])"
)
"""Names of thrusters as files have them: T1, T200, M5, thruster_3."""


def thruster_of(asked: str | None, plan: ImportMap, source: Path) -> tuple[str, str]:
    """Whose run it is, and how that is known: said, by the map, or by the file's name. Raises ConfigError else.

    >>> from rig.importing.mapping import read_map
    >>> thruster_of(None, read_map("effort_static"), Path("2026-03-01_T3_bollard.csv"))
    ('T3', "the file's name")
    """
    if asked or plan.thruster:
        return asked or plan.thruster, "--thruster" if asked else "the map"
    found = NAMED.search(source.stem)
    if found:
        return found.group(1), "the file's name"
    raise ConfigError(
        f"{source.name}: whose run is it? Neither the map nor the file's name says. Give --thruster NAME, the same for "
        'every run of it (rig fit and rig diagnose tell thrusters apart by it), or once for all: thruster = "NAME" at '
        "the top of the map"
    )
