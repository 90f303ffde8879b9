"""`--noise`: a number, or what an earlier fit knows of the noise and of C."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from identification.experiment_design.thrust_design import Noise, noise_of
from rig.errors import RecordingError

RATE_PARTS = ("C_t", "C_t_plus", "C_t_minus")
"""Coefficients by rotation rate: no C for voltages."""


@dataclass(frozen=True, slots=True)
class Known:
    """Of an earlier run."""

    noise: Noise
    C: float | None
    """N/V^2, mean of the directions and of the fits; None when the fit is not by voltage."""


def read_noise(text: str, thrusters: Sequence[str]) -> Known:
    """`text` is a number (N s^(1/2): standard error of a mean over one second) or the path of `rig fit --json`.

    Of a fit with several thrusters those named are used, all if none is. Raises RecordingError.
    """
    try:
        number = float(text)
    except ValueError:
        return _from_fit(Path(text), thrusters)
    if not (isfinite(number) and number > 0):
        raise RecordingError(f"--noise must be a number above 0 N in one second, or a fit's JSON, but is {text}")
    return Known(Noise(number), None)


def _from_fit(path: Path, thrusters: Sequence[str]) -> Known:
    fits = _fits(path)
    chosen = [fit for fit in fits if fit.get("thruster") in thrusters] or fits
    rows = np.array([row for fit in chosen for row in _rows(fit)])
    if not rows.size:
        raise RecordingError(
            f"{path}: its fits have no points with standard errors (holds), from which the noise is taken; "
            "give --noise a number"
        )
    error, seconds, thrust = rows.T
    floor = float(np.sqrt(np.mean([(fit.get("excess_std") or 0.0) ** 2 for fit in chosen])))
    return Known(noise_of(error, seconds, thrust, floor), _mean(_coefficients(chosen)))


def _fits(path: Path) -> list[dict[str, Any]]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RecordingError(
            f"--noise {path}: neither a number nor a file that can be read: {error.strerror}"
        ) from None
    except ValueError:
        raise RecordingError(f"--noise {path}: not JSON; expected what `rig fit --json` writes") from None
    fits = content.get("fits") if isinstance(content, dict) else None
    if not isinstance(fits, list) or not fits or content.get("format") != "thruster-rig-fit":
        raise RecordingError(f"--noise {path}: no fits in it; expected what `rig fit --json` writes")
    return fits


def _rows(fit: dict[str, Any]) -> Iterable[tuple[float, float, float]]:
    """(standard error, seconds, thrust without tare) of each point that has them."""
    tares = [p["value"] for p in fit.get("tare", {}).values() if p.get("value") is not None]
    tare = _mean(tares) or 0.0
    for point in fit.get("points", []):
        numbers = [point.get(key) for key in ("std_error", "t_start", "t_end", "thrust")]
        if None not in numbers and numbers[0] > 0 and numbers[2] > numbers[1]:
            yield numbers[0], numbers[2] - numbers[1], numbers[3] - tare


def _coefficients(fits: Iterable[dict[str, Any]]) -> list[float]:
    return [
        p["value"]
        for fit in fits
        for name, p in fit.get("parameters", {}).items()
        if p.get("unit") == "N/V^2" and name not in RATE_PARTS and p.get("value") is not None
    ]


def _mean(values: Sequence[float]) -> float | None:
    return float(np.mean(values)) if values else None
