"""`rig calibrate TABLE`: scale, offset and uncertainty of a load cell from known weights, for the bench file."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Final

import click
import numpy as np

from identification.estimation.load_cell_calibration import LoadCellCalibration, calibrate
from identification.recording import Floats
from rig.errors import ConfigError

COLUMNS: Final = {"mass_kg": "kg", "force_N": "N"}
GRAVITY: Final = 9.80665
"""m/s^2, standard; it differs by up to 0.3 % between places."""


def calibrate_table(table: Path, gravity: float, weights_std: float) -> int:
    """Print what a table of steps tells; the exit status. Raises ConfigError."""
    force, reading = read_steps(table, gravity)
    try:
        found = calibrate(force, reading, weights_std)
    except ValueError as error:
        raise ConfigError(f"{table}: {error}") from error
    click.echo(told(found, len(force), gravity))
    return 0 if found.wrong is None else 1


def read_steps(table: Path, gravity: float = GRAVITY) -> tuple[Floats, Floats]:
    """N and readings. Raises ConfigError naming file, line and what is expected."""
    try:
        with table.open(newline="", encoding="utf-8") as file:
            rows = csv.DictReader(line for line in file if line.strip() and not line.startswith("#"))
            names = rows.fieldnames or ()
            (column,) = [name for name in names if name in COLUMNS] or (None,)
            if column is None or "reading" not in names:
                raise ConfigError(f"{table}: expected the columns mass_kg or force_N, and reading; came {list(names)}")
            steps = [(_number(table, i, row, column), _number(table, i, row, "reading")) for i, row in enumerate(rows)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ConfigError(f"{table}: can't be read: {error}") from error
    except ValueError:
        raise ConfigError(f"{table}: give mass_kg or force_N, not both") from None
    force = np.array([step[0] for step in steps]) * (gravity if column == "mass_kg" else 1.0)
    return force, np.array([step[1] for step in steps])


def _number(table: Path, step: int, row: dict[str, str], column: str) -> float:
    try:
        value = float(row[column])
    except (TypeError, ValueError):
        value = math.nan
    if not math.isfinite(value):
        raise ConfigError(f"{table}: step {step + 1}: {column} is {row[column]!r}, a finite number is expected")
    return value


def told(found: LoadCellCalibration, steps: int, gravity: float) -> str:
    """The answer, and the lines of the bench file."""
    lines = [
        f"gain           {found.gain:.6g} per N, 95 % interval {found.low:.6g} to {found.high:.6g} ({steps} steps)",
        f"hysteresis     {found.hysteresis:.3g} +- {found.hysteresis_std:.2g} readings between up and down",
        f"scatter        {found.scatter:.3g} readings",
        f"bench file     scale = {found.scale:.8g}, offset = {found.offset:.6g}, gain_std = {found.gain_std:.3g}",
    ]
    if found.wrong is not None:
        wrong = found.wrong
        entered, says = (f"{newton:.5g} N ({newton / gravity:.5g} kg)" for newton in (wrong.entered, wrong.expected))
        lines.append(
            f"WRONG          step {wrong.step + 1}: {entered} was entered, the reading says {says}, "
            f"p = {wrong.p_value:.1g}: look at that weight, correct the table, and calibrate again"
        )
    return "\n".join(lines)
