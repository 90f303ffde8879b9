"""What the command line says in the place of a map: parameters, a row filter, what the rows are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Literal, get_args

from rig.errors import ConfigError
from rig.importing.mapping import ImportMap, read_map
from rig.importing.reading.row_filter import parse

Levels = Literal["start", "middle", "end", "no"]
"""What of its level the time of a row is; `no`: rows are no levels."""
LEVELS: tuple[Levels, ...] = get_args(Levels)


def assignments_of(texts: tuple[str, ...]) -> dict[str, float]:
    """`name=value` of --set. Raises ConfigError.

    >>> assignments_of(("nominal_voltage=48",))
    {'nominal_voltage': 48.0}
    """
    found = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError as error:
            raise ConfigError(f"--set {text}: expected name=number, for example nominal_voltage=48") from error
    return found


def plan_of(name: str, levels: Levels | None, where: str) -> ImportMap:
    """The map of this name, with what the command line says of its rows. Raises ConfigError."""
    plan = read_map(name)
    if where:
        parse(where)
        plan = replace(plan, file=replace(plan.file, where=where))
    if levels is None:
        return plan
    if plan.time.level_duration is not None:
        raise ConfigError(f"--levels is for files with times; {name} has level_duration: each row is a level already")
    if levels == "no":
        return replace(plan, time=replace(plan.time, levels=False))
    return replace(plan, time=replace(plan.time, levels=True, level_time=levels))


def refuse_without_map(file: Path, options: Mapping[str, object]) -> None:
    """Raises ConfigError where an option was given that changes a map."""
    given = [name for name, value in options.items() if value]
    if given:
        raise ConfigError(f"{file}: {', '.join(given)} is for a map: give --map, or write it into the JSON itself")
